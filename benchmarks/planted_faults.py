"""Faults of sign, order, axis and unit, planted one at a time, and whether the tests named beside
each notice it.

    python benchmarks/planted_faults.py --out results/benchmarks/planted_faults.csv

`planted_faults.csv` next to this file has one fault per row: the stage, what is wrong, the file,
the text there (which must stand there once), the text put in its place, and the test files. Each is
planted into a temporary copy of the tree. Tests that pin bytes are left out, since they notice
every change and say nothing about which is right.
"""

import argparse
import csv
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from lowalt.files.csv_tables import write_csv

ROOT = Path(__file__).resolve().parents[1]
FAULTS = Path(__file__).with_suffix(".csv")
COLUMNS = ("stage", "fault", "caught", "by")
NO_PINS = "not bytes and not byte and not fixed and not kept and not slow"
COMPILED = "njit", "jit import"


def copy_of_tree(root: Path, folder: Path) -> Path:
    """Return `folder` with a copy of the checkout's files, and its environment linked, in which
    faults can be set.
    """
    files = subprocess.run(
        ["git", "ls-files", "-z"], cwd=root, check=True, capture_output=True, text=True
    ).stdout
    for name in filter(None, files.split("\0")):
        if (root / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, folder / name)
    (folder / ".venv").symlink_to((root / ".venv").resolve())
    return folder


def test_file(root: Path, name: str) -> Path:
    """Return the test file of a name in the table, such as echo or scene/receiver, in whichever
    folder it is.

    Raises: ValueError where there is none.
    """
    for folder in ("tests", "studies"):
        for path in root.glob(f"{folder}/**/{Path(name).parent}/test_{Path(name).name}.py"):
            return path.relative_to(root)
    raise ValueError(f"no test file {name!r} in tests or studies of {root}")


def planted(tree: Path, fault: dict[str, str]) -> str:
    """Return the first test that fails with the fault in the copy `tree`, or nothing; the good text
    comes back.

    Raises: ValueError where the text to replace does not stand in the file once, or the tests
    cannot run.
    """
    path = tree / fault["file"]
    good = path.read_text()
    if good.count(fault["old"]) != 1:
        raise ValueError(
            f"{fault['file']}: {fault['old']!r} stands there {good.count(fault['old'])} times,"
            " expected 1"
        )
    with tempfile.TemporaryDirectory() as compiled:
        # Numba's kept machine code does not notice a change of a function that was compiled into
        # another file's.
        own = {"NUMBA_CACHE_DIR": compiled} if any(word in good for word in COMPILED) else {}
        tests = [str(test_file(tree, name)) for name in fault["tests"].split()]
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-x",
            "-p",
            "no:cacheprovider",
            "--tb=no",
            "-k",
            NO_PINS,
        ]
        try:
            path.write_text(good.replace(fault["old"], fault["new"]))
            found = subprocess.run(
                [*command, *tests],
                cwd=tree,
                env=os.environ | {"PYTHONPATH": str(tree / "src")} | own,
                capture_output=True,
                text=True,
                check=False,
            )
        finally:
            path.write_text(good)
    if found.returncode not in (0, 1):
        raise ValueError(
            f"{fault['fault']}: pytest ends with {found.returncode}\n{found.stdout}{found.stderr}"
        )
    failed = [
        line.split()[1]
        for line in found.stdout.splitlines()
        if line.startswith(("FAILED ", "ERROR "))
    ]
    return failed[0].partition("[")[0] if found.returncode else ""


def main() -> None:
    """Plant the faults and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, required=True)
    options.add_argument(
        "--only", default="", help="plant only faults whose stage or words hold this text"
    )
    given = options.parse_args()
    with FAULTS.open(newline="") as file:
        faults = [
            row for row in csv.DictReader(file) if given.only in f"{row['stage']} {row['fault']}"
        ]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        tree = copy_of_tree(ROOT, Path(folder) / "tree")
        for fault in faults:
            by = planted(tree, fault)
            rows.append((fault["stage"], fault["fault"], "yes" if by else "no", by))
            print(*rows[-1], sep=" | ", flush=True)
    write_csv(given.out, COLUMNS, rows)


if __name__ == "__main__":
    main()
