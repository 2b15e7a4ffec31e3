"""The command `lowalt compare`: two finished runs side by side: configuration, accuracy, time, bytes."""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

from lowalt.commands.for_programs import acts, as_json
from lowalt.files.atomic import text_of
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add `compare` to a parser's commands."""
    line = commands.add_parser(
        "compare", help="two finished runs: what differs in configuration, accuracy, time and bytes",
        epilog="example: lowalt compare results/default results/tiny",
    )  # fmt: skip
    line.add_argument("runs", type=Path, nargs=2, metavar="RUN", help="folder of a finished run")
    acts(line, run)


def leaves(block: dict, where: str = "") -> Iterator[tuple[str, object]]:
    """Yield (dotted key, value) of everything in nested mappings that is no mapping, or is an empty one."""
    for key, value in block.items():
        if isinstance(value, dict) and value:
            yield from leaves(value, f"{where}{key}.")
        else:
            yield f"{where}{key}", value


def _accuracies(folder: Path) -> dict[str, float]:
    """The table's averages over the SNRs (%) by "protocol scheme"; empty where the run trained nothing."""
    path = folder / "accuracy.csv"
    rows = read_csv(path, "protocol", "scheme", "snr_db", "accuracy_percent") if path.exists() else []
    averages = [row for row in rows if row["snr_db"] == "avg"]
    return {f"{row['protocol']} {row['scheme']}": float(row["accuracy_percent"]) for row in averages}


def _seconds(folder: Path) -> dict[str, float]:
    """Processor seconds by stage; empty where the run has no report."""
    path = folder / "stages.csv"
    return {row["rule"]: float(row["cpu_s"]) for row in read_csv(path, "rule", "cpu_s")} if path.exists() else {}


def _sizes(folder: Path) -> dict[str, int]:
    """Samples and bytes of the data set; empty where the run has none."""
    path = folder / "shards/index.json"
    if not path.exists():
        return {}
    index = json.loads(text_of(path, "index"))
    return {"samples": index["samples"], "bytes": index["bytes"]}


def facts(folder: Path) -> dict[str, dict]:
    """Return the facts of one run's folder, {part: {name: value}}.

    Parts: configuration (dotted keys), accuracy_percent, processor_s, data.
    Raises: InputError naming the folder that is no run's.
    """
    if not (folder / "config.yaml").is_file():
        raise InputError(f"{folder}: has no config.yaml, expected the folder of a finished run")
    measured = {"accuracy_percent": _accuracies, "processor_s": _seconds, "data": _sizes}
    return {"configuration": dict(leaves(load_yaml(folder / "config.yaml")))} | {
        part: of(folder) for part, of in measured.items()
    }


def compared(one: Path, other: Path) -> dict[str, dict[str, tuple]]:
    """Return {part: {name: (value of the first, value of the second)}} for all that differs or is measured in two runs.

    Parts: configuration (only what differs), accuracy_percent, processor_s, data. None stands where a run has none.
    Raises: InputError naming the folder that is no run's.
    """
    found = [facts(folder) for folder in (one, other)]

    def pairs(part: str) -> dict[str, tuple]:
        """Values of both runs in one part, by name; None where a run has none."""
        first, second = (mine[part] for mine in found)
        return {name: (first.get(name), second.get(name)) for name in dict.fromkeys([*first, *second])}

    differs = {name: pair for name, pair in pairs("configuration").items() if pair[0] != pair[1]}
    return {"configuration": differs} | {part: pairs(part) for part in ("accuracy_percent", "processor_s", "data")}


def _cell(value: object) -> str:
    """A value as text, a number with four digits; a dash for None."""
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def _change(part: str, first: object, second: object) -> str:
    """The difference of two measured numbers; of times and sizes as a share of the first too."""
    if part == "configuration" or None in (first, second):
        return ""
    share = f" ({second / first - 1:+.1%})" if part != "accuracy_percent" and first else ""
    return f"   {second - first:+.4g}{share}"


def run(given: argparse.Namespace) -> str:
    """Return the comparison as text, or as JSON.

    Raises: as `compared`.
    """
    found = compared(*given.runs)
    if given.json:
        return as_json(found)
    lines = []
    for part, rows in found.items():
        if not rows:
            continue
        lines += ["", f"{part.replace('_', ' ')}: {given.runs[0]} | {given.runs[1]}"]
        wide = max(map(len, rows))
        for name, (first, second) in rows.items():
            lines.append(f"  {name:{wide}}  {_cell(first)} | {_cell(second)}{_change(part, first, second)}")
    return "\n".join(lines[1:])
