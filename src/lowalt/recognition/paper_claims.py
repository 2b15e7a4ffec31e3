"""The paper's claims, and whether their orderings hold on a run's own data."""

from collections.abc import Iterable
from pathlib import Path

from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError

CLAIMS = (
    *(("A:VRP+TRP+VT", f"A:{single}", "three spectra over one") for single in ("VRP", "TRP", "VT")),
    *(("ABC:VRP+TRP+VT", f"{station}:VRP+TRP+VT", "three stations over one") for station in "ABC"),
    *(
        ("ABC:VRP+TRP+VT", f"ABC:{name}mean fusion", "proposed over mean fusion")
        for name in ("", "Swin-B ", "ConvNeXt-B ", "ViT-B/16 ")
    ),
)
"""The paper's claims: the scheme said to be better, the other, and the claim's name."""
SEEDS = 3
"""Trainings a scheme must have before its rank is stated: another seed moves accuracies as much as
many schemes do.
"""


def read_published(path: str | Path) -> dict[tuple[str, str], float]:
    """Return the paper's accuracy in percent, averaged over the SNRs, by (protocol, scheme).

    Raises: InputError for a file that is no such table.
    """
    rows = read_csv(
        path, "protocol", "scheme", "snr_db", "accuracy_percent", what="published accuracies"
    )
    try:
        return {
            (row["protocol"], row["scheme"]): float(row["accuracy_percent"])
            for row in rows
            if row["snr_db"] == "avg"
        }
    except ValueError as error:
        raise InputError(f"{path}: not a table of accuracies ({error!r})") from error


def verdict(low: float, high: float, seeds: int) -> str:
    """Return whether an ordering holds by the bounds of its interval.

    Too few trainings do not rank the schemes.
    """
    if seeds < SEEDS:
        return "not ranked"
    if low > 0:
        return "holds"
    if high < 0:
        return "reversed"
    return "undecided"


def ordering_rows(compared: list[list], published: dict[tuple[str, str], float]) -> Iterable[list]:
    """Yield the rows of orderings.csv.

    Columns: protocol, scheme, over, claim, paper_points, seeds, difference_points, low, high,
    ordering.
    compared: the rows of comparisons.csv.
    """
    for protocol, better, other, claim, _, seeds, difference, low, high in compared:
        percent = published.get((protocol, better))
        percent_of_other = published.get((protocol, other))
        paper = ""
        if percent is not None and percent_of_other is not None:
            paper = f"{percent - percent_of_other:.2f}"
        ordering = verdict(float(low), float(high), seeds)
        yield [protocol, better, other, claim, paper, seeds, difference, low, high, ordering]
