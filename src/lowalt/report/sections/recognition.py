"""What the page says of recognition beyond accuracy: orderings, false alarms, calibration, accuracy over range and
aspect, what trainings took, how apart subtypes lie."""

import argparse

from matplotlib import pyplot as plt

from lowalt.common.csv_tables import read_csv
from lowalt.report.figures import accuracy_cost
from lowalt.report.figures.style import legend_below, png, scheme_colours

TABLES = {
    "orderings": ("protocol", "scheme", "over", "claim", "paper_points", "difference_points", "ordering"),
    "alarms": ("protocol", "scheme", "asked_percent", "detected_percent", "bird_percent", "vehicle_percent",
               "pedestrian_percent"),
    "calibration": ("protocol", "scheme", "calibration_error", "brier", "cross_entropy"),
    "reliability": ("protocol", "scheme", "confidence_percent", "accuracy_percent", "samples"),
    "ranges": ("protocol", "scheme", "from", "to", "accuracy_percent", "samples"),
    "aspects": ("protocol", "scheme", "from", "to", "accuracy_percent", "samples"),
    "seeds": ("protocol", "scheme", "seed", "accuracy_percent", "backbone", "weights", "parameters", "steps", "train_s",
              "train_processor_s", "samples_per_s", "precision", "ranks", "hardware"),
    "distances": ("category", "subtype", "nearest_trained", "trained_distance", "trained_size_ratio"),
}  # fmt: skip
TRANSFER = ("protocol", "scheme", "trained_on", "snr_db", "accuracy_percent", "own_percent", "difference_points", "low",
            "high", "seeds", "spread_points")  # fmt: skip
FEWEST = 30
"""Samples a band must have to be drawn: with fewer, one sample moves it by more than three points."""


def add_options(options: argparse.ArgumentParser) -> None:
    """Add the options that name this section's tables."""
    for name in TABLES:
        options.add_argument(f"--{name}", required=True, help=f"table of {name} (.csv)")
    options.add_argument("--transfer", help="other runs' models on this run's test samples (.csv)")
    options.add_argument("--accuracy-cost", help="what accuracy costs in time, measured before (.csv)")


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


def ordering_words(rows: list[dict[str, str]]) -> str:
    """Return in one sentence how many of the paper's orderings hold, and which do not."""
    holding = [row for row in rows if row["ordering"] == "holds"]
    words = f"Of {len(rows)} orderings of the paper that this run can test, {len(holding)} hold"
    for verdict, phrase in (("reversed", "the other way round"), ("undecided", "not decided by these samples")):
        names = [
            f"{row['scheme']} over {row['over']} ({row['protocol']})" for row in rows if row["ordering"] == verdict
        ]
        words += f"; {phrase}: {', '.join(names)}" if names else ""
    return words + "."


def section(given: argparse.Namespace) -> dict:
    """Return what the page's template takes as `more`, and its pictures under `pictures`.

    Raises: InputError for a table without a column it must have.
    """
    found: dict = {name: read_csv(getattr(given, name), *columns) for name, columns in TABLES.items()}
    found["words"] = ordering_words(found["orderings"]) if found["orderings"] else ""
    found["distances"] = {row["subtype"]: row for row in found["distances"]}
    found["fewest"] = FEWEST
    moved = read_csv(given.transfer, *TRANSFER) if given.transfer else []
    found["transfer"] = [row for row in moved if row["snr_db"] == "avg"]
    found["pictures"] = {"reliability": reliability_figure(found["reliability"])} if found["reliability"] else {}
    bands = {"distance to the nearest station used (m)": found["ranges"], "aspect seen from it (°)": found["aspects"]}
    if any(int(row["samples"]) >= FEWEST for rows in bands.values() for row in rows):
        found["pictures"]["bands"] = band_figure(bands)
    if given.accuracy_cost:
        rows = read_csv(given.accuracy_cost, *accuracy_cost.NEEDED, *accuracy_cost.FIDELITY)
        found["pictures"]["accuracy_cost"] = accuracy_cost.draw(rows)
    return found
