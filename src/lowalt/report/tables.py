"""Reading and pivoting the run's small CSV tables for the page; no drawing, no HTML."""

import json
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from lowalt.files.atomic import text_of
from lowalt.files.errors import InputError


def by_scheme(rows: Iterable[dict[str, str]]) -> dict[str, dict[str, dict[str, float]]]:
    """Return accuracy in percent as protocol -> scheme -> SNR label -> value, in the order of the rows."""
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
    """Return macro F1 on average over the SNRs as protocol -> scheme -> "value (low to high)", in percent.

    Tables of earlier versions have no such column; their schemes are left out.
    """
    result: dict = defaultdict(dict)
    for row in rows:
        if row["snr_db"] == "avg" and row.get("macro_f1_percent"):
            value, low, high = (float(row[f"macro_f1_{name}"]) for name in ("percent", "low", "high"))
            result[row["protocol"]][row["scheme"]] = f"{value:.1f} ({low:.1f} to {high:.1f})"
    return dict(result)


def measurement(path: str | Path) -> dict:
    """Return one job's measurement from Snakemake's benchmark file (JSON lines, extended; the last run counts).

    Raises: InputError for a file that is no such benchmark.
    """
    try:
        last = json.loads(text_of(path, "benchmark").splitlines()[-1])
        return {name: last[name] for name in ("rule_name", "wildcards", "s", "cpu_time", "max_rss")}
    except (ValueError, IndexError, KeyError) as error:
        raise InputError(f"{path}: not an extended benchmark file ({error!r})") from error


def stage_times(paths: Iterable[str | Path]) -> list[dict]:
    """Return the time and memory of each rule, from Snakemake's benchmark files (JSON lines, extended).

    One dict a rule: rule, jobs, wall_s and cpu_s (sums over jobs), peak_mib (largest job; sampled, so a short peak
    can be missed).
    Raises: InputError for a file that is no benchmark.
    """
    rules: dict[str, dict] = {}
    for path in paths:
        job = measurement(path)
        name, wall, cpu, memory = job["rule_name"], job["s"], job["cpu_time"], job["max_rss"]
        entry = rules.setdefault(name, {"rule": name, "jobs": 0, "wall_s": 0.0, "cpu_s": 0.0, "peak_mib": 0.0})
        entry["jobs"] += 1
        entry["wall_s"] += float(wall)
        # Jobs under Snakemake's sampling interval have no CPU or memory reading; it writes null or "NA".
        entry["cpu_s"] += float(cpu) if isinstance(cpu, (int, float)) else 0.0
        entry["peak_mib"] = max(entry["peak_mib"], float(memory) if isinstance(memory, (int, float)) else 0.0)
    return list(rules.values())


def confusion(rows: Iterable[dict[str, str]]) -> dict[tuple[str, str], dict[tuple[str, str], int]]:
    """Return counts as (protocol, scheme) -> (true category, predicted category) -> samples."""
    result: dict = defaultdict(lambda: defaultdict(int))
    for row in rows:
        result[row["protocol"], row["scheme"]][row["category"], row["predicted"]] += int(row["samples"])
    return {key: dict(counts) for key, counts in result.items()}
