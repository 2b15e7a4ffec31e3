"""Which tests run which lines of the package, and how long each test takes: one run of the suite with pytest-cov.

Compiled kernels run outside the interpreter, and lines of definitions run at import: there no test is recorded. A fault
in such a line is shown to the tests that run any line of the same file, or else of a file that imports it.
"""

import json
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from coverage import CoverageData

_RUN = """[run]
data_file = {folder}/data
"""


class Coverage(NamedTuple):
    """`lines[file][line]`: names of tests; `seconds[test]`: what a test took; files from the root of the repository."""

    lines: dict[str, dict[int, list[str]]]
    seconds: dict[str, float]


def measure(root: Path, folder: Path) -> Coverage:
    """Run the suite once under coverage and keep the map in `folder`/map.json.

    Raises RuntimeError where a test fails: a fault cannot be told from a test that fails anyway.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "coverage.cfg").write_text(_RUN.format(root=root, folder=folder), encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-n", "2", "--dist", "loadfile", "-p", "no:cacheprovider",
               "-m", "not slow and not workflow", f"--junitxml={folder}/tests.xml", f"--cov={root}/src/lowalt",
               "--cov-context=test", f"--cov-config={folder}/coverage.cfg", "--cov-report="]  # fmt: skip
    if subprocess.run(command, cwd=root, check=False).returncode:
        raise RuntimeError(f"{folder}/tests.xml: tests fail before any fault is set in")
    found = Coverage(_lines(folder / "data", root), _seconds(folder / "tests.xml"))
    (folder / "map.json").write_text(json.dumps(found._asdict()), encoding="utf-8")
    return found


def read(folder: Path) -> Coverage:
    """The map that `measure` kept in `folder`.

    Raises FileNotFoundError where none was kept.
    """
    kept = json.loads((folder / "map.json").read_text(encoding="utf-8"))
    lines = {file: {int(line): tests for line, tests in rows.items()} for file, rows in kept["lines"].items()}
    return Coverage(lines, kept["seconds"])


def _lines(data: Path, root: Path) -> dict[str, dict[int, list[str]]]:
    """For each measured file below `root`, the tests that run each line."""
    kept = CoverageData(str(data))
    kept.read()
    found: dict[str, dict[int, list[str]]] = {}
    for file in kept.measured_files():
        rows = kept.contexts_by_lineno(file)
        tests = {line: sorted({_test(name) for name in names if name}) for line, names in rows.items()}
        found[str(Path(file).relative_to(root))] = {line: names for line, names in tests.items() if names}
    return found


def _test(context: str) -> str:
    """`FILE::test[case]|run` of pytest-cov without its case; a fixture's `|setup` serves all tests of its file."""
    name, _, phase = context.rpartition("|")
    return re.sub(r"\[.*", "", name, flags=re.DOTALL) if phase == "run" else name.partition("::")[0]


def _seconds(report: Path) -> dict[str, float]:
    """Seconds of each test function, all its cases together."""
    seconds: dict[str, float] = defaultdict(float)
    for case in ElementTree.parse(report).iter("testcase"):
        name = re.sub(r"\[.*", "", case.get("name", ""), flags=re.DOTALL)
        seconds[f"{case.get('classname', '').replace('.', '/')}.py::{name}"] += float(case.get("time", 0))
    return dict(seconds)


def importers(root: Path, file: str) -> set[str]:
    """Files of the package that import the module of `file`, by the text of their import lines."""
    module = file.removeprefix("src/").removesuffix(".py").replace("/", ".").removesuffix(".__init__")
    package, _, name = module.rpartition(".")
    pattern = re.compile(rf"^\s*(from {re.escape(module)} import|import {re.escape(module)}\b"
                         rf"|from {re.escape(package)} import [^#\n]*\b{re.escape(name)}\b)", re.MULTILINE)  # fmt: skip
    return {str(path.relative_to(root)) for path in sorted((root / "src").rglob("*.py"))
            if pattern.search(path.read_text(encoding="utf-8"))}  # fmt: skip


def shown_tests(root: Path, found: Coverage, file: str, line: int, limit: float) -> list[str]:
    """Tests that run a line, the quickest first, until they take `limit` seconds together."""
    rows = found.lines.get(file, {})
    names = set(rows.get(line, ()))
    if not names:
        names = {test for tests in rows.values() for test in tests}
    if not names:
        near = (found.lines.get(other, {}) for other in importers(root, file))
        names = {test for lines in near for tests in lines.values() for test in tests}
    files = {name for name in names if "::" not in name}
    names |= {test for test in found.seconds if test.partition("::")[0] in files}
    chosen, total = [], 0.0
    for name in sorted(names & found.seconds.keys(), key=lambda test: (found.seconds[test], test)):
        total += found.seconds[name]
        if chosen and total > limit:
            break
        chosen.append(name)
    return chosen
