"""The command `lowalt compare`: two finished runs, or two methods of the benchmark's table."""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

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
    about = "folder of a finished run, or a method of the benchmark's table, such as "
    about += "'RBF-SVM on features'"
    line.add_argument("runs", type=Path, nargs=2, metavar="RUN", help=about)


def leaves(block: dict, where: str = "") -> Iterator[tuple[str, object]]:
    """Yield (dotted key, value) for all values of nested mappings, empty mappings among them."""
    for key, value in block.items():
        if isinstance(value, dict) and value:
            yield from leaves(value, f"{where}{key}.")
        else:
            yield f"{where}{key}", value


def facts(folder: Path) -> dict[str, dict]:
    """Return the facts of one run's folder, {section: {name: value}}.

    Sections: configuration (dotted keys), accuracy_percent (averages over the SNRs by "protocol
    scheme"), processor_s (by stage), data (samples and bytes); a section is empty where the run
    has no such table.
    Raises: InputError naming the folder that is no run's, or the file in it that is damaged.
    """
    result: dict[str, dict] = {"configuration": dict(leaves(of_run(folder)))}
    result |= {section: {} for section in MEASURED}
    accuracy = folder / "accuracy.csv"
    if accuracy.exists():
        for (scheme, protocol), share in averages(accuracy).items():
            result["accuracy_percent"][f"{protocol} {scheme}"] = share
    stages = folder / "stages.csv"
    if stages.exists():
        for row in read_csv(stages, "rule", "cpu_s"):
            result["processor_s"][row["rule"]] = number(row, "cpu_s", stages)
    index = folder / "shards/index.json"
    if index.exists():
        sizes = read_object(index, "an index of shards")
        check_brought("sizes", sizes, index)
        result["data"] = {name: sizes[name] for name in ("samples", "bytes")}
    return result


def compared(*folders: Path) -> dict[str, dict[str, tuple]]:
    """Return {section: {name: (value of the first run, value of the second)}} of two runs.

    The configuration has its differences only, the sections MEASURED have everything; a missing
    value is None. Raises: InputError naming the folder that is no run's.
    """
    first, second = map(facts, folders)
    pairs: dict[str, dict[str, tuple]] = {}
    for section in first:
        pairs[section] = {}
        for name in first[section] | second[section]:
            pair = (first[section].get(name), second[section].get(name))
            if section in MEASURED or pair[0] != pair[1]:
                pairs[section][name] = pair
    return pairs


def _cell(value: object) -> str:
    """A value as text, a number with four digits; a dash for None."""
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value)


def _change(section: str, first: Any, second: Any) -> str:
    """The difference of two measured numbers; for times and sizes also relative to the first."""
    if section not in MEASURED or None in (first, second):
        return ""
    difference = f"   {second - first:+.4g}"
    if section == "accuracy_percent" or not first:
        return difference
    return f"{difference} ({second / first - 1:+.1%})"


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
    pairs = compared(*options.runs)
    blocks = []
    for section, rows in pairs.items():
        if not rows:
            continue
        width = max(map(len, rows))
        lines = [f"{section.replace('_', ' ')}: {options.runs[0]} | {options.runs[1]}"]
        for name, (first, second) in rows.items():
            change = _change(section, first, second)
            lines.append(f"  {name:{width}}  {_cell(first)} | {_cell(second)}{change}")
        blocks.append("\n".join(lines))
    return Answer(pairs, "\n\n".join(blocks))
