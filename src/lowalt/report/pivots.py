"""Rearranges rows of the run's tables by protocol, scheme and SNR for the page.

It draws nothing and writes no HTML.
"""

from collections import defaultdict
from collections.abc import Iterable


def by_scheme(rows: Iterable[dict[str, str]]) -> dict[str, dict[str, dict[str, float]]]:
    """Return accuracy in percent as protocol -> scheme -> SNR label -> value, in order."""
    result: dict = defaultdict(lambda: defaultdict(dict))
    for row in rows:
        result[row["protocol"]][row["scheme"]][row["snr_db"]] = float(row["accuracy_percent"])
    return {protocol: dict(schemes) for protocol, schemes in result.items()}


def spreads(rows: Iterable[dict[str, str]]) -> dict[str, dict[str, str]]:
    """Return spread and number of the seeds behind each average, as protocol -> scheme -> words."""
    result: dict = defaultdict(dict)
    for row in rows:
        if row["snr_db"] == "avg" and int(row["seeds"]) > 1:
            words = f"± {float(row['spread_points']):.2f} ({row['seeds']} seeds)"
            result[row["protocol"]][row["scheme"]] = words
    return dict(result)


def macro_f1(rows: Iterable[dict[str, str]]) -> dict[str, dict[str, str]]:
    """Return macro F1 in percent, averaged over the SNRs.

    It is protocol -> scheme -> "value (low to high)".

    Tables of earlier versions have no such column; their schemes are left out.
    """
    result: dict = defaultdict(dict)
    for row in rows:
        if row["snr_db"] == "avg" and row.get("macro_f1_percent"):
            value = float(row["macro_f1_percent"])
            low = float(row["macro_f1_low"])
            high = float(row["macro_f1_high"])
            result[row["protocol"]][row["scheme"]] = f"{value:.1f} ({low:.1f} to {high:.1f})"
    return dict(result)


def confusion(rows: Iterable[dict[str, str]]) -> dict[tuple[str, str], dict[tuple[str, str], int]]:
    """Return counts over all SNRs: (protocol, scheme) -> (true category, predicted) -> samples."""
    result: dict = defaultdict(lambda: defaultdict(int))
    for row in rows:
        result[row["protocol"], row["scheme"]][row["category"], row["predicted"]] += int(
            row["samples"]
        )
    return {key: dict(counts) for key, counts in result.items()}


def best_schemes(accuracies: dict[str, dict[str, dict[str, float]]]) -> dict[str, str]:
    """Return the scheme of the highest average accuracy of each protocol, out of `by_scheme`."""
    return {
        protocol: max(schemes, key=lambda name: schemes[name]["avg"])
        for protocol, schemes in accuracies.items()
    }
