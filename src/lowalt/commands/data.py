"""The commands `lowalt verify` and `lowalt remake`: check a data set, make stored samples again."""

import argparse
from pathlib import Path

from lowalt.commands.command_line import Answer, add_command
from lowalt.shards.verify import faults, frozen


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `verify` or `remake` to a parser's commands."""
    if name == "verify":
        line = add_command(commands, name, verified)
        line.add_argument(
            "--remake", type=int, default=0, metavar="N", help="also make N random samples again"
        )
    else:
        line = add_command(commands, name, remade)
    line.add_argument("index", type=_index, help="index.json of the data set")
    line.add_argument("--clouds", type=Path, help="folder of the run's clouds (default: ../clouds)")
    line.add_argument(
        "--occluders", type=Path, help="folder of its surfaces (default: occluders next to clouds)"
    )
    if name == "remake":
        line.add_argument("sample", nargs="+", metavar="KEY", help="keys of samples")


def _checked(lines: list[str], good: str) -> Answer:
    """The faults, one per line, or a line that there is none."""
    return Answer({"good": not lines, "faults": lines}, "\n".join(lines) or good, int(bool(lines)))


def _index(text: str) -> Path:
    """The index that a command line names.

    A link to the index alone is resolved, to find the shards next to the file.
    """
    path = Path(text)
    if path.is_symlink():
        return path.resolve()
    return path


def verified(options: argparse.Namespace) -> Answer:
    """Check a data set and, if it has no fault, remake samples.

    Raises: InputError where there is no index.
    """
    from lowalt.shards.remake import opened, some

    lines = list(faults(options.index))
    if options.remake and not lines:
        remaker = opened(options.index, options.clouds, options.occluders)
        for number in some(remaker.shards, options.remake):
            lines += remaker.faults(number)
    good = f"{options.index}: every byte is as it was written, "
    count = len(frozen(options.index))
    if count:
        good += f"also of {count} clouds and motion tables"
    else:
        good += "clouds and motion tables have no checksums here"
    if options.remake:
        good += f", {options.remake} samples made again"
    return _checked(lines, good)


def remade(options: argparse.Namespace) -> Answer:
    """Make samples again and compare them. Raises: InputError for a key that the data set lacks."""
    from lowalt.shards.remake import number_of, opened

    remaker = opened(options.index, options.clouds, options.occluders)
    lines = []
    for key in options.sample:
        lines += remaker.faults(number_of(remaker.shards, key))
    return _checked(lines, f"{len(options.sample)} samples made again, equal in every byte")
