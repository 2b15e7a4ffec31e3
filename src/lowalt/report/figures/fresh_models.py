"""The figure of accuracy against distinct motion models and against processor time, one mark a training.

python -m lowalt.report.figures.fresh_models --table stream.csv --figure stream.png
"""

import argparse

from matplotlib import pyplot as plt
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from lowalt.common.command import run
from lowalt.common.csv_tables import read_csv
from lowalt.common.files import replacing
from lowalt.report.figures.style import png

NEEDED = (
    "candidate", "motion_models", "train_core_s", "make_core_s", "held_percent", "held_low", "held_high",
    "kept_percent", "kept_low", "kept_high",
)  # fmt: skip
MARKS = "osD^vP*X<>ph"


def draw(rows: list[dict]) -> bytes:
    """Return the figure (PNG); rows: those of `lowalt.measure.fresh_models`."""
    drawing, panels = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained", sharey=True)
    for number, row in enumerate(rows):
        spent = float(row["train_core_s"]) + float(row["make_core_s"])
        for panel, across in zip(panels, (float(row["motion_models"]), spent), strict=True):
            for kind, style in (("held", "full"), ("kept", "none")):
                value, low, high = (float(row[f"{kind}_{end}"]) for end in ("percent", "low", "high"))
                reach = [[max(value - low, 0)], [max(high - value, 0)]]
                panel.errorbar(
                    across, value, reach, fmt=MARKS[number % len(MARKS)], fillstyle=style, ms=6, lw=1,
                    color=f"C{number % 10}", label=row["candidate"] if kind == "held" else None,
                )  # fmt: skip
    panels[0].set(xscale="log", xlabel="distinct motion models trained on", ylabel="accuracy (%)")
    panels[1].set(xscale="log", xlabel="processor time of making samples and of training (s)")
    for panel in panels:
        panel.grid(alpha=0.3, which="both")
        panel.xaxis.set_minor_formatter(NullFormatter())
    # Times lie within one power of ten or two, so that powers alone would be too few numbers.
    panels[1].xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    panels[1].xaxis.set_major_formatter(ScalarFormatter())
    handles, names = panels[1].get_legend_handles_labels()
    title = "filled: held-out subtypes\nhollow: trained subtypes"
    drawing.legend(handles, names, fontsize=7, title=title, title_fontsize=7, loc="outside right center")
    return png(drawing)


def main(arguments: list[str]) -> None:
    """Write the figure."""
    options = argparse.ArgumentParser(prog="python -m lowalt.report.figures.fresh_models", description=__doc__)
    options.add_argument("--table", required=True, help="table of lowalt.measure.fresh_models (.csv)")
    options.add_argument("--figure", required=True, help="picture to write (.png)")
    given = options.parse_args(arguments)
    picture = draw(read_csv(given.table, *NEEDED))
    with replacing(given.figure) as temporary:
        temporary.write_bytes(picture)


if __name__ == "__main__":
    run(main)
