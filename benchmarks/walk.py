"""The walk of a new user, timed: from clone to report, to a target and to a network of one's own in the report.

    python benchmarks/walk.py --out results/benchmarks/walk.csv --label NAME [--inside FOLDER]

Follows the documents alone: blocks of README.md and of two tutorials are run as they stand there, in an empty clone.
Files that a page names are written, commands and Python are run, in the order of the page. `--inside` walks on in a
checkout where `make` is done already, without that first step. Columns:

    label      the name given
    step       number of the step
    document   the page that prints it
    does       the command, or the first line of the Python, or the file that is written
    wall_s     time that it took (s)
    shows      a file that the step must have left, and a word that this file must hold; empty for most steps
    hardware   the machine
"""

import argparse
import contextlib
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from lowalt.common.csv_tables import read_csv, short, write_csv
from lowalt.common.hardware import describe

ROOT = Path(__file__).parents[1]
COLUMNS = ("label", "step", "document", "does", "wall_s", "shows", "hardware")
FENCE = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
TUTORIALS = ("docs/tutorials/target.md", "docs/tutorials/backbone.md")
SHOWN = {
    "make": ("results/default/report.html", "Provenance"),
    ".venv/bin/lowalt run config/tiny.yaml with_mine.yaml": ("results/with-mine/subtypes.csv", "My drone"),
    ".venv/bin/lowalt run config/tiny.yaml my_network.yaml": ("results/my-network/report.html", "my_network.py:small"),
}
"""A file that must be there after a command, and a word in it."""


class Step(NamedTuple):
    """One thing to do: its page, its sort (sh, python or file), a file's name, and the text as the page prints it."""

    document: str
    sort: str
    name: str
    text: str

    @property
    def does(self) -> str:
        """The step in a line."""
        return f"write {self.name}" if self.sort == "file" else self.text.strip().splitlines()[0]


def steps(root: Path = ROOT) -> list[Step]:
    """Return all steps of the walk, as the documents of a checkout print them: the first command of README.md, then
    every block of the tutorials."""
    first = next(text for sort, _, text in FENCE.findall((root / "README.md").read_text()) if sort == "sh")
    found = [Step("README.md", "sh", "", first.splitlines()[0].partition("  #")[0].strip())]
    for page in TUTORIALS:
        for sort, name, text in FENCE.findall((root / page).read_text()):
            if name:
                found.append(Step(page, "file", name, text))
            elif sort == "python":
                found.append(Step(page, "python", "", text))
            elif sort == "sh":
                found += [Step(page, "sh", "", line) for line in text.splitlines() if line.strip()]
    return found


def walked(step: Step, folder: Path) -> float:
    """Do one step in a checkout; returns the seconds it took.

    Raises: CalledProcessError where it fails; SystemExit where it does not leave what it must.
    """
    begun = time.monotonic()
    if step.sort == "file":
        (folder / step.name).write_text(step.text)
    elif step.sort == "python":
        subprocess.run([".venv/bin/python", "-"], input=step.text, text=True, cwd=folder, check=True)
    else:
        subprocess.run(step.text, shell=True, cwd=folder, check=True)
    took = time.monotonic() - begun
    file, word = SHOWN.get(step.text, ("", ""))
    if file and word not in (folder / file).read_text():
        raise SystemExit(f"{step.does}: no {word!r} in {file}")
    return took


def main() -> None:
    """Walk and write the table."""
    options = argparse.ArgumentParser(description="Time the walk of a new user through the documents.")
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--label", required=True, help="name of these rows; rows of the same name are replaced")
    options.add_argument(
        "--inside", type=Path, help="a checkout where `make` is done already (default: an empty clone)"
    )
    given = options.parse_args()
    with contextlib.ExitStack() as stack:
        folder = given.inside
        if folder is None:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "lowalt"
            subprocess.run(["git", "clone", "--quiet", str(ROOT), str(folder)], check=True)
        todo = steps(folder)[1 if given.inside else 0 :]
        rows = []
        for number, step in enumerate(todo, 2 if given.inside else 1):
            took = walked(step, folder)
            shows = " holds ".join(SHOWN.get(step.text, ()))
            rows.append({"label": given.label, "step": number, "document": step.document, "does": step.does,
                         "wall_s": short(took), "shows": shows, "hardware": describe()})  # fmt: skip
            print(f"{number:3}  {took:7.1f} s  {step.does}", file=sys.stderr)
    print(f"in all {sum(float(row['wall_s']) for row in rows):.0f} s", file=sys.stderr)
    kept = [row for row in read_csv(given.out) if row["label"] != given.label] if given.out.exists() else []
    write_csv(given.out, COLUMNS, [*kept, *rows])


if __name__ == "__main__":
    main()
