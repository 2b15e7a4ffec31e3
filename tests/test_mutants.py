"""The command that sets small faults into the package: which places it finds, what it writes, what kills a fault."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from mutants import room_of, room_rows, wilson, with_others
from mutation.candidates import Mutant, draw, mutated, of_file
from mutation.coverage_map import Coverage, naming, shown_tests, unmapped
from mutation.kept import Kept
from mutation.survivors import changed, earlier, survivor_row
from mutation.trials import Outcome, copy_of_tree, trial

from small_tree import small_tree

ROOT = Path(__file__).parents[1]
SOURCE = '''"""A doc with 1 + 2."""
LIMIT: int | None = 3
kernel = lambda **options: lambda function: function


def reach(a: float | None, b: float) -> float:
    """Add."""
    return a + b if a < LIMIT else -b


@kernel(boundscheck=False)
def kernel_of(a):
    return a


if __name__ == "__main__":
    reach(1, 2 + 3)
'''


@pytest.fixture
def tree(tmp_path):
    return small_tree(tmp_path, SOURCE)


def test_places_are_operations_and_constants_and_no_annotations(tree):
    found = of_file(tree, "src/lowalt/reach.py")
    names = {(mutant.line, mutant.operator.rpartition("/")[2]) for mutant in found}
    assert (8, "ReplaceBinaryOperator_Add_Sub") in names and (8, "ReplaceComparisonOperator_Lt_LtE") in names
    assert (2, "NumberReplacer") in names and (8, "ReplaceUnaryOperator_Delete_USub") in names
    assert not any("BitOr" in name for _, name in names)
    # No line of a docstring, of a compiler's settings, or of a command's start.
    assert {line for line, _ in names} == {2, 8}


def test_every_place_changes_the_text_in_its_own_line(tree):
    for mutant in of_file(tree, "src/lowalt/reach.py"):
        pairs = zip(SOURCE.splitlines(), mutated(SOURCE, mutant).splitlines(), strict=True)
        assert [number for number, (before, after) in enumerate(pairs, 1) if before != after] == [mutant.line]
    with pytest.raises(ValueError, match=r"reach.py: no place 9"):
        mutated(SOURCE, Mutant("reach.py", 7, "core/AddNot", 9))


def test_a_draw_takes_a_line_once_and_the_same_for_the_same_seed(tree):
    found = of_file(tree, "src/lowalt/reach.py")
    drawn = draw(found, 5, np.random.default_rng(1))
    assert drawn == draw(found, 5, np.random.default_rng(1))
    assert len({mutant.line for mutant in drawn}) == len(drawn) == len({mutant.line for mutant in found})


def test_the_quickest_tests_of_a_line_come_first_until_time_is_up(tree):
    file = "src/lowalt/reach.py"
    found = Coverage({file: {7: ["t.py::slow", "t.py::quick", "t.py::middle"], 8: ["u.py"], 2: ["t.py::slow"]}},
                     {"t.py::slow": 30.0, "t.py::quick": 1.0, "t.py::middle": 5.0, "u.py::one": 1.0})  # fmt: skip
    assert shown_tests(tree, found, file, 7, 10.0) == ["t.py::quick", "t.py::middle"]
    assert shown_tests(tree, found, file, 8, 10.0) == ["u.py::one"]
    # Tests of the room come before quicker ones of other rooms.
    near = Coverage({file: {7: ["t.py::quick", "tests/test_reach_far.py::slow"]}},
                    {"t.py::quick": 1.0, "tests/test_reach_far.py::slow": 9.0})  # fmt: skip
    assert shown_tests(tree, near, file, 7, 10.0) == ["tests/test_reach_far.py::slow", "t.py::quick"]
    # One that takes longer by itself is shown with those that do not.
    assert shown_tests(tree, near, file, 7, 5.0) == ["t.py::quick", "tests/test_reach_far.py::slow"]
    assert shown_tests(tree, found, file, 7, 0.5) == ["t.py::quick"]
    # A line of definitions runs at import, perhaps in a test: all tests of the file are shown.
    assert set(shown_tests(tree, found, file, 2, 100.0)) == {"t.py::slow", "t.py::quick", "t.py::middle", "u.py::one"}


def test_a_fault_that_a_test_notices_is_killed_and_taken_out_again(tree):
    (tree / "src/lowalt/__init__.py").touch()
    (tree / "tests/test_reach.py").write_text(
        "import sys\nsys.path.insert(0, 'src/lowalt')\nimport reach\n\n"
        "def test_sum():\n    assert reach.reach(1, 2) == 3\n\ndef test_nothing():\n    pass\n"
    )
    found = {
        mutant.operator.rpartition("_")[2] + str(mutant.line): mutant for mutant in of_file(tree, "src/lowalt/reach.py")
    }
    tests = ["tests/test_reach.py::test_sum"]
    assert trial(tree, found["Sub8"], tests, 1.0).killed
    assert not trial(tree, found["LtE8"], tests, 1.0).killed
    assert not trial(tree, found["Sub8"], ["tests/test_reach.py::test_nothing"], 1.0).killed
    assert (tree / "src/lowalt/reach.py").read_text() == SOURCE


def test_a_fault_in_a_kernel_that_another_file_calls_is_compiled_in_and_killed(tmp_path):
    """Machine code of the caller is kept from a run without the fault, and that run's is used again afterwards."""
    for folder in ("src", "tests"):
        (tmp_path / folder).mkdir()
    # Trials find this folder alone; the package comes from this checkout.
    (tmp_path / "tests/conftest.py").write_text(f"import sys\nsys.path.append({str(ROOT / 'src')!r})\n")
    jit = "from lowalt.common.jit import kernel\n\n\n@kernel()\ndef {}\n"
    (tmp_path / "src/inner_kernel.py").write_text(jit.format("double(x):\n    return 2.0 * x"))
    outer = "import inner_kernel\n" + jit.format("four_times(x):\n    return inner_kernel.double(2.0 * x)")
    (tmp_path / "src/outer_kernel.py").write_text(outer)
    test = "import outer_kernel\n\ndef test_it():\n    assert outer_kernel.four_times(1.0) == 4.0\n"
    (tmp_path / "tests/test_it.py").write_text(test)
    (fault,) = [found for found in of_file(tmp_path, "src/inner_kernel.py") if "Mul_Div" in found.operator]
    tests = ["tests/test_it.py"]
    environment = os.environ | {"PYTHONPATH": f"{tmp_path}/src:{ROOT}/src"}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests]
    assert subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True).returncode == 0
    kept = {path.name: path.read_bytes() for path in (tmp_path / "src").rglob("*.nbi")}
    assert {name.partition(".")[0] for name in kept} == {"inner_kernel", "outer_kernel"}
    assert trial(tmp_path, fault, tests, 1.0).killed
    after = {path.name: path.read_bytes() for path in (tmp_path / "src").rglob("inner_kernel*.nbi")}
    assert after and after.items() <= kept.items()


def test_outcomes_are_kept_until_the_source_or_a_survivor_s_tests_change(tree):
    (tree / "tests/test_reach.py").write_text("")
    one, two = of_file(tree, "src/lowalt/reach.py")[:2]
    tests, calls = ["tests/test_reach.py::test_sum"], []

    def tried(mutant, killed):
        def try_it():
            calls.append(mutant)
            return Outcome(mutant, killed, 1)

        return Kept(tree / "kept.jsonl", tree).of(mutant, tests, try_it)

    for _ in range(2):
        assert tried(one, True) == Outcome(one, True, 1) and tried(two, False) == Outcome(two, False, 1)
    assert calls == [one, two]
    (tree / "tests/test_reach.py").write_text("def test_sum(): pass\n")
    tried(one, True), tried(two, False)
    assert calls == [one, two, two]
    (tree / "src/lowalt/reach.py").write_text(SOURCE + "# edited\n")
    tried(one, True), tried(two, False)
    assert calls == [one, two, two, one, two]
    # A survivor of every look that a new test kills is still known as one.
    Kept(tree / "kept.jsonl", tree).note([two])
    tests.append("tests/test_reach.py::test_more")
    tried(two, True)
    kept = Kept(tree / "kept.jsonl", tree)
    assert [kept.survived_once(each) for each in (one, two)] == [False, True]


def test_survivors_of_earlier_draws_are_found_again_by_their_text_where_it_still_stands(tree):
    places = of_file(tree, "src/lowalt/reach.py")
    known = [survivor_row(tree, Outcome(mutant, False, 1), {}) for mutant in places if mutant.line == 8]
    assert len({(row["before"], row["after"]) for row in known}) == len(known) > 3
    (tree / "src/lowalt/reach.py").write_text(SOURCE.replace("\n\n\ndef", "\nMORE = 2 < 3\n\n\ndef", 1))
    moved = of_file(tree, "src/lowalt/reach.py")
    found = earlier(tree, known, moved, [])
    assert {mutant.line for mutant in found} == {9}
    assert [changed(tree, mutant) for mutant in found] == [(row["before"], row["after"]) for row in known]
    assert list(found.values()) == known and list(earlier(tree, known, moved, list(found)[1:])) == list(found)[:1]
    (tree / "src/lowalt/reach.py").write_text(SOURCE.replace("a + b", "b + a"))
    assert not earlier(tree, known, of_file(tree, "src/lowalt/reach.py"), [])


def test_tests_that_name_a_module_are_found_by_their_text_and_else_those_that_name_its_importers(tree):
    """`far` is imported by `reach` alone; `lonely` by none, so all tests are its own."""
    for name, text in (("far", ""), ("lonely", ""), ("reach", "from lowalt.room import far\n"), ("more", "")):
        (tree / "src/lowalt/room").mkdir(exist_ok=True)
        (tree / f"src/lowalt/room/{name}.py").write_text(text)
    texts = {"a": "from lowalt.room.reach import x\n", "b": "from lowalt.room import (\n    more,\n    reach,\n)\n",
             "c": "room.reach: --out\n", "d": "from lowalt.room import preach\nreach = lowalt.room.reacher\n",
             "e": "from lowalt.room import more\n\n# Nothing of reach.\n"}  # fmt: skip
    names = [f"test_{name}.py" for name in texts]
    for name, text in texts.items():
        (tree / f"tests/test_{name}.py").write_text(text)
    told = {name: naming(tree, names, f"src/lowalt/room/{name}.py") for name in ("reach", "more", "far", "lonely")}
    assert told["reach"] == told["far"] == {"test_a.py", "test_b.py", "test_c.py"}
    assert told["more"] == {"test_b.py", "test_e.py"} and told["lonely"] == set(names)
    # Without a map, a line has the whole files of tests that name its module.
    found = unmapped(tree, names, {"src/lowalt/room/far.py", "src/lowalt/room/more.py"})
    assert shown_tests(tree, found, "src/lowalt/room/far.py", 1, 9.0) == [f"tests/test_{name}.py" for name in "abc"]
    assert shown_tests(tree, found, "src/lowalt/room/more.py", 1, 1.0) == ["tests/test_b.py"]


def test_rates_have_wilson_s_interval():
    """A known case of the formula: 8 of 10 lie between 49.0 and 94.3 percent."""
    assert wilson(8, 10) == pytest.approx((0.490, 0.943), abs=5e-4)
    assert wilson(5, 5) == pytest.approx((0.566, 1.0), abs=5e-4) and wilson(0, 5)[0] == pytest.approx(0)


def test_a_call_for_some_rooms_keeps_the_lines_of_the_others_and_equivalent_faults_count_for_nothing(tree):
    assert (
        room_of("src/lowalt/recognition/metrics.py") == "statistics" and room_of("src/lowalt/__main__.py") == "__main__"
    )
    one, two, three = of_file(tree, "src/lowalt/reach.py")[:3]
    outcomes = [Outcome(one, True, 1), Outcome(two, False, 1), Outcome(three, False, 1)]
    survivors = [{"file": one.file, "verdict": verdict} for verdict in ("equivalent: nothing is added", "open")]
    kept = Kept(tree / "kept.jsonl", tree)
    (row,) = room_rows({"reach": ([*outcomes, one], [one, two, three])}, outcomes, kept, survivors)
    assert (row["places"], row["tried"], row["killed"], row["survived"], row["equivalent"]) == (4, 3, 1, 2, 1)
    assert row["killed_percent"] == "50.0"
    before = [{"room": "reach", "tried": "9"}, {"room": "echo", "tried": "8"}]
    assert with_others(before, [row], {"reach"}) == [before[1], row]
    lines = [{"file": "src/lowalt/reach.py"}, {"file": "src/lowalt/echo/api.py"}]
    assert with_others(lines, [], {"reach"}) == [lines[1]]


def test_a_copy_of_the_tree_follows_the_checkout_and_keeps_machine_code(tmp_path):
    copy = copy_of_tree(ROOT, tmp_path / "copy")
    (copy / "src/lowalt/__pycache__").mkdir(exist_ok=True)
    (copy / "src/lowalt/__pycache__/kept.nbi").touch()
    (copy / "src/lowalt/stale.py").touch()
    (copy / "src/lowalt/__init__.py").write_text("1 / 0\n")
    assert copy_of_tree(ROOT, copy) == copy
    assert (copy / "src/lowalt/__init__.py").read_bytes() == (ROOT / "src/lowalt/__init__.py").read_bytes()
    assert (copy / "src/lowalt/__pycache__/kept.nbi").exists() and not (copy / "src/lowalt/stale.py").exists()
