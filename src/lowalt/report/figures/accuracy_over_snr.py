"""The figure of recognition accuracy over SNR."""

from matplotlib import pyplot as plt

from lowalt.report.figures.style import SNR_LABELS, legend_below, png, scheme_colours


def accuracy_over_snr(ours: dict, published: dict) -> bytes:
    """Draw accuracy over SNR, one panel a protocol; solid is this run, dashed the published value on its own data.

    ours, published: protocol -> scheme -> SNR label -> percent.
    """
    figure, panels = plt.subplots(1, len(ours), figsize=(5.5 * len(ours), 4), squeeze=False)
    colours = scheme_colours(name for schemes in ours.values() for name in schemes)
    for panel, (protocol, schemes) in zip(panels[0], ours.items(), strict=True):
        for scheme, values in schemes.items():
            labels = [label for label in values if label != "avg"]
            panel.plot(labels, [values[label] for label in labels], "o-", color=colours[scheme], label=scheme)
            paper = published.get(protocol, {}).get(scheme, {})
            known = [label for label in labels if label in paper]
            if known:
                panel.plot(known, [paper[label] for label in known], "--", color=colours[scheme], alpha=0.6)
        panel.set(title=f"{protocol} subtypes", xlabel="SNR (dB)", ylabel="accuracy (%)")
        ticks = [label for label in next(iter(schemes.values())) if label != "avg"]
        panel.set_xticks(range(len(ticks)), [SNR_LABELS.get(label, label) for label in ticks])
        panel.grid(alpha=0.3)
    figure.tight_layout()
    legend_below(figure, "solid: this run, dashed: paper" if published else None)
    return png(figure)
