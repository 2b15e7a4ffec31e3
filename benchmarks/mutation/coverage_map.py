"""Which tests run which lines of the package, and how long each test takes: every file of tests once, with pytest-cov.

The map of a file of tests is kept until that file changes. Compiled kernels run outside the interpreter, and lines of
definitions run at import: there no test is recorded. A fault in such a line is shown to the tests that run any line of
the same file or of a file that imports it, and first to those whose file names the module: a test that calls a kernel
alone runs no recorded line.
"""

import ast
import hashlib
import json
import os
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from coverage import CoverageData


class Coverage(NamedTuple):
    """`lines[file][line]`: names of tests; `seconds[test]`: what a test took; files from the root of the repository."""

    lines: dict[str, dict[int, list[str]]]
    seconds: dict[str, float]


def measure(root: Path, files: list[str], folder: Path, jobs: int, go_on: Callable[[], bool]) -> Coverage | None:
    """Run each of the `files` of tests once under coverage unless its map is kept in `folder`; None where time was up.

    A test that fails without a fault cannot judge one: it is named and left out.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = [f"tests/{name}" for name in files]

    def one(name: str) -> Coverage | None:
        """The map of a file of tests, from `folder` where it is kept."""
        digest = hashlib.sha256((root / name).read_bytes()).hexdigest()[:16]
        kept = folder / f"{Path(name).stem}-{digest}.json"
        if not kept.exists():
            if not go_on():
                return None
            found = _of_file(root, name, folder / Path(name).stem)
            kept.write_text(json.dumps(found._asdict()), encoding="utf-8")
            print(f"mapped   {name}: {len(found.seconds)} tests, {sum(found.seconds.values()):.0f} s", flush=True)
        content = json.loads(kept.read_text(encoding="utf-8"))
        lines = {file: {int(line): tests for line, tests in rows.items()} for file, rows in content["lines"].items()}
        return Coverage(lines, content["seconds"])

    with ThreadPoolExecutor(jobs) as pool:
        maps = list(pool.map(one, names))
    return None if None in maps else joined(found for found in maps if found)


def joined(maps: Iterable[Coverage]) -> Coverage:
    """One map of several files of tests."""
    lines: dict[str, dict[int, list[str]]] = defaultdict(lambda: defaultdict(list))
    seconds: dict[str, float] = {}
    for found in maps:
        seconds |= found.seconds
        for file, rows in found.lines.items():
            for line, tests in rows.items():
                lines[file][line] += tests
    return Coverage({file: dict(rows) for file, rows in lines.items()}, seconds)


def _of_file(root: Path, name: str, beside: Path) -> Coverage:
    """Run one file of tests under coverage; `beside`: where its data and report are written for the moment."""
    data, report, settings = (beside.with_suffix(end) for end in (".data", ".xml", ".cfg"))
    settings.write_text(f"[run]\ndata_file = {data}\n", encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", name,
               "-m", "not slow and not workflow", f"--junitxml={report}", f"--cov={root}/src/lowalt",
               "--cov-context=test", f"--cov-config={settings}", "--cov-report="]  # fmt: skip
    environment = os.environ | {"PYTHONPATH": f"{root}/src"}
    subprocess.run(command, cwd=root, env=environment, check=False, stdout=subprocess.DEVNULL)
    seconds, failed = _seconds(report) if report.exists() else ({}, {name})
    for test in sorted(failed):
        print(f"left out {test}: it fails without a fault", flush=True)
    lines = _lines(data, root, failed) if data.exists() else {}
    for path in (data, report, settings):
        path.unlink(missing_ok=True)
    return Coverage(lines, {test: spent for test, spent in seconds.items() if test not in failed})


def _lines(data: Path, root: Path, failed: set[str]) -> dict[str, dict[int, list[str]]]:
    """For each measured file below `root`, the tests that run each line, without those that failed."""
    kept = CoverageData(str(data))
    kept.read()
    found: dict[str, dict[int, list[str]]] = {}
    for file in kept.measured_files():
        rows = kept.contexts_by_lineno(file)
        tests = {line: sorted({_test(name) for name in names if name} - failed) for line, names in rows.items()}
        found[str(Path(file).relative_to(root))] = {line: names for line, names in tests.items() if names}
    return found


def _test(context: str) -> str:
    """`FILE::test[case]|run` of pytest-cov without its case; a fixture's `|setup` serves all tests of its file."""
    name, _, phase = context.rpartition("|")
    return re.sub(r"\[.*", "", name, flags=re.DOTALL) if phase == "run" else name.partition("::")[0]


def _seconds(report: Path) -> tuple[dict[str, float], set[str]]:
    """Seconds of each test function, all its cases together, and the functions of which a case failed."""
    seconds: dict[str, float] = defaultdict(float)
    failed = set()
    for case in ElementTree.parse(report).iter("testcase"):
        name = re.sub(r"\[.*", "", case.get("name", ""), flags=re.DOTALL)
        test = f"{case.get('classname', '').replace('.', '/')}.py::{name}"
        if case.find("skipped") is None:
            seconds[test] += float(case.get("time", 0))
        if case.find("failure") is not None or case.find("error") is not None:
            failed.add(test)
    return dict(seconds), failed


def _module(file: str) -> str:
    """Dotted name of the module in a source file."""
    return file.removeprefix("src/").removesuffix(".py").replace("/", ".").removesuffix(".__init__")


def naming(root: Path, names: list[str], file: str) -> set[str]:
    """Files of tests among `names` whose text names the module of a source file, or else a module that imports it;
    all where there are none."""
    texts = {name: (root / "tests" / name).read_text(encoding="utf-8") for name in names}
    for files in ({file}, importers(root, file)):
        parts = [_module(each).removeprefix("lowalt.").rpartition(".") for each in files]
        patterns = [re.compile(rf"\b{re.escape(f'{package}.{name}'.lstrip('.'))}\b"
                               rf"|from lowalt\.?{re.escape(package)} import (\([^)]*|[^\n]*)\b{name}\b")
                    for package, _, name in parts]  # fmt: skip
        found = {name for name, text in texts.items() if any(pattern.search(text) for pattern in patterns)}
        if found:
            return found
    return set(names)


def unmapped(root: Path, names: list[str], files: set[str]) -> Coverage:
    """What `measure` returns, without a run: each source file has the whole files of tests that name its module.

    Times are not known: each test file counts a second, so `shown_tests` takes as many as its limit has seconds.
    """
    told = {file: {0: [f"tests/{name}" for name in sorted(naming(root, names, file))]} for file in files}
    return Coverage(told, {test: 1.0 for rows in told.values() for test in rows[0]})


def importers(root: Path, file: str) -> set[str]:
    """Files of the package that import the module of `file`, by the text of their import lines."""
    module = _module(file)
    package, _, name = module.rpartition(".")
    pattern = re.compile(rf"^\s*(from {re.escape(module)} import|import {re.escape(module)}\b"
                         rf"|from {re.escape(package)} import [^#\n]*\b{re.escape(name)}\b)", re.MULTILINE)  # fmt: skip
    return {str(path.relative_to(root)) for path in sorted((root / "src").rglob("*.py"))
            if pattern.search(path.read_text(encoding="utf-8"))}  # fmt: skip


def _room(file: str) -> str:
    """The room of a source file, empty where it stands in none."""
    return Path(file).parts[2].removesuffix(".py") if len(Path(file).parts) > 2 else ""


def _of_room(test: str, file: str) -> bool:
    """Whether a file of tests is named after the room of `file`, tests/test_ROOM..."""
    room = _room(file)
    return bool(room) and test.startswith(f"tests/test_{room}")


def _in_function(path: Path, line: int) -> bool:
    """Whether a line of a file stands in the body of a function."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    bodies = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    return any(node.body[0].lineno <= line <= (node.end_lineno or 0) for node in bodies)


def shown_tests(root: Path, found: Coverage, file: str, line: int, limit: float) -> list[str]:
    """Tests that run a line until they take `limit` seconds together: those of its room first, each half the quickest
    first. The first of them is shown even where it takes longer."""
    rows = found.lines.get(file, {})
    # A line that runs at import belongs to no test, also where the import stands in one.
    own = set(rows.get(line, ())) if _in_function(root / file, line) else set()
    names = own or {test for tests in rows.values() for test in tests}
    near = [found.lines.get(other, {}) for other in importers(root, file)] if not own else []
    names |= {test for lines in near for tests in lines.values() for test in tests}
    mapped = {name.partition("::")[0].removeprefix("tests/") for name in found.seconds if name.startswith("tests/")}
    told = {f"tests/{name}" for name in naming(root, sorted(mapped), file)} if not own else set()
    files = {name for name in names if "::" not in name} | told
    names |= {test for test in found.seconds if test.partition("::")[0] in files}

    def place(test: str) -> tuple:
        """What is compared to bring tests into order."""
        return not _of_room(test, file), test.partition("::")[0] not in told, found.seconds[test], test

    order = sorted(names & found.seconds.keys(), key=place)
    chosen, total = [], 0.0
    for name in order:
        if total + found.seconds[name] <= limit:
            total += found.seconds[name]
            chosen.append(name)
    return chosen if chosen[:1] == order[:1] else [*chosen, order[0]]
