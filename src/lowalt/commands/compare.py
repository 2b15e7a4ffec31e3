"""The command `lowalt compare`: two finished runs side by side, or two methods of the benchmark's table."""

import argparse
from collections.abc import Iterator
from pathlib import Path

from lowalt.commands.command_line import Answer, add_command
from lowalt.config.extensions import function_offered, offered
from lowalt.config.layers import of_run
from lowalt.config.schema import check_brought
from lowalt.files.csv_tables import number, read_csv
from lowalt.files.errors import InputError
from lowalt.files.json_objects import read_object
from lowalt.workflow.closing import averages

MEASURED = ("accuracy_percent", "processor_s", "data")


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `compare` to a parser's commands."""
    line = add_command(commands, name, run)
    about = "folder of a finished run, or a method of the benchmark's table, such as 'RBF-SVM on features'"
    line.add_argument("runs", type=Path, nargs=2, metavar="RUN", help=about)


def leaves(block: dict, where: str = "") -> Iterator[tuple[str, object]]:
    """Yield (dotted key, value) for all values in nested mappings that are not mappings or are empty."""
    for key, value in block.items():
        if isinstance(value, dict) and value:
            yield from leaves(value, f"{where}{key}.")
        else:
            yield f"{where}{key}", value


def facts(folder: Path) -> dict[str, dict]:
    """Return the facts of one run's folder, {part: {name: value}}.

    Parts: configuration (dotted keys), accuracy_percent (averages over the SNRs by "protocol scheme"), processor_s (by
    stage), data (samples and bytes); a part is empty where the run has no such table.
    Raises: InputError naming the folder that is no run's, or the file in it that is damaged.
    """
    config = of_run(folder)
    accuracy, stages, index = (folder / name for name in ("accuracy.csv", "stages.csv", "shards/index.json"))
    shares = averages(accuracy) if accuracy.exists() else {}
    times = read_csv(stages, "rule", "cpu_s") if stages.exists() else []
    data = read_object(index, "an index of shards") if index.exists() else {}
    if index.exists():
        check_brought("sizes", data, index)
    return {
        "configuration": dict(leaves(config)),
        "accuracy_percent": {f"{protocol} {scheme}": share for (scheme, protocol), share in shares.items()},
        "processor_s": {row["rule"]: number(row, "cpu_s", stages) for row in times},
        "data": {name: data[name] for name in ("samples", "bytes") if data},
    }


def compared(*folders: Path) -> dict[str, dict[str, tuple]]:
    """Return {part: {name: (value of the first run, value of the second)}}: only differences of the configuration, and
    everything in the parts MEASURED. A missing value is None.

    Raises: InputError naming the folder that is no run's.
    """
    first, second = map(facts, folders)
    pairs = {
        part: {name: (first[part].get(name), second[part].get(name)) for name in {**first[part], **second[part]}}
        for part in ("configuration", *MEASURED)
    }
    pairs["configuration"] = {name: pair for name, pair in pairs["configuration"].items() if pair[0] != pair[1]}
    return pairs


def _cell(value: object) -> str:
    """A value as text, a number with four digits; a dash for None."""
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def _change(part: str, first: object, second: object) -> str:
    """The difference of two measured numbers; for times and sizes also relative to the first."""
    if part not in MEASURED or None in (first, second):
        return ""
    share = f" ({second / first - 1:+.1%})" if part != "accuracy_percent" and first else ""
    return f"   {second - first:+.4g}{share}"


def others(first: str, second: str) -> Answer:
    """Compare what an extension knows by these names. Raises: InputError where none does."""
    refusals = []
    for name, module in offered("comparisons").items():
        compare_named = function_offered("comparisons", name, module, "compared_named")
        try:
            return Answer(*compare_named(first, second))
        except InputError as error:
            refusals.append(str(error))
    if not refusals:
        raise InputError(f"{first}: no such folder, expected that of a finished run")
    raise InputError("; ".join(refusals))


def run(options: argparse.Namespace) -> Answer:
    """Compare two runs, or what an extension compares. Raises: as `compared` and `others`."""
    if not any(map(Path.exists, options.runs)):
        return others(*map(str, options.runs))
    pairs, blocks = compared(*options.runs), []
    for part, rows in pairs.items():
        wide = max(map(len, rows), default=0)
        lines = [f"  {name:{wide}}  {_cell(first)} | {_cell(second)}{_change(part, first, second)}"
                 for name, (first, second) in rows.items()]  # fmt: skip
        head = f"{part.replace('_', ' ')}: {options.runs[0]} | {options.runs[1]}"
        blocks += ["\n".join([head, *lines])] if rows else []
    return Answer(pairs, "\n\n".join(blocks))
