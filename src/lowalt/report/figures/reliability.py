"""The figure of accuracy over the network's confidence."""

from matplotlib import pyplot as plt

from lowalt.report.figures.bands import FEWEST
from lowalt.report.figures.style import legend_below, png, scheme_colours


def reliability_figure(rows: list[dict[str, str]]) -> bytes:
    """Draw accuracy over confidence, a panel a protocol, a line a scheme; on the diagonal a probability is true."""
    protocols = list(dict.fromkeys(row["protocol"] for row in rows))
    figure, panels = plt.subplots(1, len(protocols), figsize=(4.6 * len(protocols), 4.2), squeeze=False)
    colours = scheme_colours(row["scheme"] for row in rows)
    for panel, protocol in zip(panels[0], protocols, strict=True):
        panel.plot([25, 100], [25, 100], color="0.7", lw=1)
        for scheme in dict.fromkeys(row["scheme"] for row in rows if row["protocol"] == protocol):
            mine = [row for row in rows if (row["protocol"], row["scheme"]) == (protocol, scheme)]
            mine = [row for row in mine if int(row["samples"]) >= FEWEST]
            x, y = ([float(row[name]) for row in mine] for name in ("confidence_percent", "accuracy_percent"))
            panel.plot(x, y, "o-", ms=4, color=colours[scheme], label=scheme)
        panel.set(title=f"{protocol} subtypes", xlabel="confidence (%)", ylabel="accuracy (%)", xlim=(25, 101))
        panel.grid(alpha=0.3)
    figure.tight_layout()
    legend_below(figure)
    return png(figure)
