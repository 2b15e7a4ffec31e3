"""Trials of small faults: processor time kills a fault, the clock decides nothing; which tests a kernel is shown."""

import resource
import signal
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from mutants import room_rows
from mutation import trials
from mutation.candidates import of_file
from mutation.coverage_map import Coverage, shown_tests
from mutation.forked import Limits, run_tests
from mutation.kept import Kept
from mutation.survivors import survivor_row
from mutation.trials import Outcome

from small_tree import small_tree

SOURCE = "def reach(a):\n    return a + 1\n"


@pytest.fixture
def tree(tmp_path):
    return small_tree(tmp_path, SOURCE)


def _ran(tree, body, limits):
    """Status of a test with this body, the processor time of this process's children, and the time on the clock."""
    (tree / "tests/test_it.py").write_text(f"import subprocess, time\n\ndef test_it():\n    {body}\n")
    before, since = sum(_children()), time.monotonic()
    status = run_tests(tree, ["tests/test_it.py"], limits, tree / "src/lowalt/reach.py", b"")
    return status, sum(_children()) - before, time.monotonic() - since


def _children():
    """Processor time, user's and system's, of the processes that this one started and that have ended."""
    return resource.getrusage(resource.RUSAGE_CHILDREN)[:2]


def test_a_loop_without_end_is_stopped_by_its_processor_time(tree):
    status, spent, _ = _ran(tree, "while True: pass", Limits(1, 60.0))
    assert status == -signal.SIGXCPU and 0.9 < spent < 3.0


def test_a_process_that_a_test_starts_has_the_same_limit(tree):
    status, _, _ = _ran(tree, "assert subprocess.check_output(['sh', '-c', 'ulimit -t']) == b'77\\n'", Limits(77, 60.0))
    assert status == 0


def test_a_test_that_waits_is_stopped_by_the_clock_alone(tree):
    status, spent, wall = _ran(tree, "time.sleep(60)", Limits(50, 0.5))
    assert status is None and spent < 20 and 0.5 < wall < 30


@pytest.mark.parametrize(
    ("status", "killed", "late", "undecided"),
    [(0, 0, 0, 0), (1, 1, 0, 0), (-signal.SIGXCPU, 1, 1, 0), (-signal.SIGSEGV, 1, 0, 0), (None, 0, 0, 1)],
)
def test_only_a_failure_or_processor_time_kills(tree, monkeypatch, status, killed, late, undecided):
    asked = []
    monkeypatch.setattr(trials, "run_tests", lambda tree, tests, limits, *_: asked.append(limits) or status)
    fault = of_file(tree, "src/lowalt/reach.py")[0]
    outcome = trials.trial(tree, fault, ["tests/test_it.py"], 4.1)
    assert outcome == Outcome(fault, bool(killed), 1, late=bool(late), undecided=bool(undecided))
    assert asked == [Limits(201, 804)] and (tree / "src/lowalt/reach.py").read_text() == SOURCE


def test_a_fault_s_machine_code_goes_with_it_and_that_of_the_good_file_comes_back(tree):
    """With `cache=True` numba makes a new list for the fault and numbers its machine code from 1 again."""
    path, kept = tree / "src/lowalt/reach.py", tree / "src/lowalt/__pycache__"
    kept.mkdir(exist_ok=True)
    good = {
        "reach.reach-6.py311.nbi": b"list",
        "reach.reach-6.py311.1.nbc": b"code",
        "other.f-1.py311.1.nbc": b"another",
    }
    for name, content in good.items():
        (kept / name).write_bytes(content)
    before = path.stat().st_mtime_ns
    with trials._fault(path, "LIMIT = 4\n"):
        for name in ("reach.reach-6.py311.nbi", "reach.reach-6.py311.1.nbc", "reach.reach-6.py311.2.nbc"):
            (kept / name).write_bytes(b"of the fault")
        assert path.read_text() == "LIMIT = 4\n"
    assert {file.name: file.read_bytes() for file in kept.iterdir()} == good
    assert path.read_text() == SOURCE and path.stat().st_mtime_ns == before


def test_an_undecided_fault_is_kept_and_counted_apart_and_waits_for_a_verdict(tree):
    (tree / "tests/test_it.py").touch()
    one, two = of_file(tree, "src/lowalt/reach.py")[:2]
    outcomes = [Outcome(one, False, 1, undecided=True), Outcome(two, True, 1, late=True)]
    for outcome in outcomes:
        Kept(tree / "kept.jsonl", tree).of(outcome.mutant, ["tests/test_it.py"], lambda outcome=outcome: outcome)
    kept = Kept(tree / "kept.jsonl", tree)
    assert [kept.outcome(each, ["tests/test_it.py"]) for each in (one, two)] == outcomes
    (row,) = room_rows({"reach": ([one, two], [one, two])}, outcomes, kept, [])
    counts = [row[name] for name in ("tried", "killed", "by_time", "undecided", "survived", "killed_percent")]
    assert counts == [2, 1, 1, 1, 0, "50.0"]
    listed = survivor_row(tree, outcomes[0], {})
    assert (listed["now"], listed["verdict"]) == ("undecided", "open")


def test_tests_of_a_file_that_names_the_module_are_shown_to_a_line_that_no_test_is_known_to_run(tree):
    """A compiled kernel runs outside the interpreter, so the map does not know the test that calls it alone."""
    for name, text in (("it", "from lowalt.reach import reach\n"), ("other", "from lowalt import other\n")):
        (tree / f"tests/test_{name}.py").write_text(text)
    seconds = {"tests/test_it.py::kernel": 3.0, "tests/test_it.py::slow": 8.0, "tests/test_other.py::quick": 1.0}
    found = Coverage({"src/lowalt/reach.py": {1: ["tests/test_other.py::quick"]}}, seconds)
    assert shown_tests(tree, found, "src/lowalt/reach.py", 2, 9.0) == [
        "tests/test_it.py::kernel", "tests/test_other.py::quick"
    ]  # fmt: skip
    # A test that is known to run the line is enough.
    known = Coverage({"src/lowalt/reach.py": {2: ["tests/test_other.py::quick"]}}, seconds)
    assert shown_tests(tree, known, "src/lowalt/reach.py", 2, 9.0) == ["tests/test_other.py::quick"]
