"""The figure of accuracy over bands of a quantity, such as distance or aspect."""

from matplotlib import pyplot as plt

from lowalt.report.figures.style import legend_below, png, scheme_colours

FEWEST = 30
"""Samples a band must have to be drawn: with fewer, one sample moves it by more than three points."""


def band_figure(bands: dict[str, list[dict[str, str]]]) -> bytes:
    """Draw accuracy over bands of a quantity, a row a protocol, a column a quantity, a line a scheme.

    bands: rows {protocol, scheme, from, to, accuracy_percent, samples} by the quantity's name with its unit.
    """
    protocols = list(dict.fromkeys(row["protocol"] for rows in bands.values() for row in rows))
    size = (5.2 * len(bands), 3.4 * len(protocols))
    figure, panels = plt.subplots(len(protocols), len(bands), figsize=size, squeeze=False, sharey="row")
    colours = scheme_colours(row["scheme"] for rows in bands.values() for row in rows)
    for line, protocol in zip(panels, protocols, strict=True):
        for panel, (quantity, rows) in zip(line, bands.items(), strict=True):
            mine = [row for row in rows if row["protocol"] == protocol and int(row["samples"]) >= FEWEST]
            for scheme in dict.fromkeys(row["scheme"] for row in mine):
                found = [row for row in mine if row["scheme"] == scheme]
                middles = [(float(row["from"]) + float(row["to"])) / 2 for row in found]
                shares = [float(row["accuracy_percent"]) for row in found]
                panel.plot(middles, shares, "o-", ms=4, color=colours[scheme], label=scheme)
            panel.set(title=f"{protocol} subtypes", xlabel=quantity)
            panel.grid(alpha=0.3)
        line[0].set_ylabel("accuracy (%)")
    figure.tight_layout()
    legend_below(figure)
    return png(figure)
