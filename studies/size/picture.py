"""Draw accuracy over the number of motion models: `python studies/size/picture.py`, from and into
`results/`.
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt

from lowalt.config.command import run
from lowalt.files.csv_tables import read_csv

RESULTS = Path(__file__).parent / "results"
PARTS = {"seen_test": "subtypes trained on", "test": "held-out subtypes"}
SCHEMES = {
    "ABC:VRP+TRP+VT": ("three stations", "C0", 0.97),
    "A:VRP+TRP+VT": ("station A", "C1", 1.03),
}
"""Words, colour, and a factor that keeps bars apart."""


def main(arguments: list[str]) -> None:
    """Draw `results/size.csv` into `results/size.png`."""
    line = argparse.ArgumentParser("picture.py", description=__doc__)
    line.parse_args(arguments)
    rows = [row for row in read_csv(RESULTS / "size.csv") if row["snr_db"] == "all"]
    figure, axes = plt.subplots(1, 2, sharey=True, figsize=(8, 3.4), layout="constrained")
    for axis, (part, title) in zip(axes, PARTS.items(), strict=True):
        for scheme, (words, colour, apart) in SCHEMES.items():
            for equal in (True, False):
                mine = [
                    row
                    for row in rows
                    if (row["scheme"], row["part"]) == (scheme, part)
                    and (row["steps"] == "1000") == equal
                ]
                share, low, high = (
                    [float(row[name]) for row in mine] for name in ("percent", "low", "high")
                )
                bars = [
                    [value - end for value, end in zip(share, low, strict=True)],
                    [end - value for value, end in zip(share, high, strict=True)],
                ]
                said = f"{words}, " + (
                    "1000 steps, three trainings" if equal else "18 000 steps, one training"
                )
                axis.errorbar(
                    [int(row["models"]) * (apart if equal else apart**4) for row in mine],
                    share,
                    bars,
                    fmt="o-" if equal else "s",
                    mfc=colour if equal else "white",
                    color=colour,
                    capsize=3,
                    label=said,
                )
        axis.set(
            xscale="log",
            title=title,
            xlabel="motion models per subtype",
            xticks=(100, 400, 1600, 6000),
        )
        axis.set_xticklabels(("100", "400", "1600", "6000"))
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("right answers, % (95 % interval)")
    axes[0].legend(fontsize=7, loc="lower right")
    figure.savefig(RESULTS / "size.png", dpi=90)


if __name__ == "__main__":
    run(main)
