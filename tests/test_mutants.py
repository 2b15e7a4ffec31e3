"""The command that sets small faults into the package: which places it finds, what it writes, what kills a fault."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from mutants import trial
from mutation.candidates import Mutant, draw, mutated, of_file
from mutation.coverage_map import Coverage, shown_tests

SOURCE = '''"""A doc with 1 + 2."""
LIMIT: int | None = 3


def reach(a: float | None, b: float) -> float:
    """Add."""
    return a + b if a < LIMIT else -b
'''


@pytest.fixture
def tree(tmp_path):
    (tmp_path / "src/lowalt").mkdir(parents=True)
    (tmp_path / "tests").mkdir()
    (tmp_path / "src/lowalt/reach.py").write_text(SOURCE)
    return tmp_path


def test_places_are_operations_and_constants_and_no_annotations(tree):
    found = of_file(tree, "src/lowalt/reach.py")
    names = {(mutant.line, mutant.operator.rpartition("/")[2]) for mutant in found}
    assert (7, "ReplaceBinaryOperator_Add_Sub") in names and (7, "ReplaceComparisonOperator_Lt_LtE") in names
    assert (2, "NumberReplacer") in names and (7, "ReplaceUnaryOperator_Delete_USub") in names
    assert not any("BitOr" in name for _, name in names) and not any(line == 1 for line, _ in names)


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


def test_the_quickest_tests_of_a_line_come_first_until_time_is_up():
    file = "src/lowalt/reach.py"
    found = Coverage({file: {7: ["t.py::slow", "t.py::quick", "t.py::middle"], 2: ["u.py"]}},
                     {"t.py::slow": 30.0, "t.py::quick": 1.0, "t.py::middle": 5.0, "u.py::one": 1.0})  # fmt: skip
    assert shown_tests(Path(), found, file, 7, 10.0) == ["t.py::quick", "t.py::middle"]
    assert shown_tests(Path(), found, file, 2, 10.0) == ["u.py::one"]
    assert set(shown_tests(Path(), found, file, 5, 100.0)) == {"t.py::slow", "t.py::quick", "t.py::middle", "u.py::one"}


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
    assert trial(tree, found["Sub7"], tests, 1.0).killed
    assert not trial(tree, found["LtE7"], tests, 1.0).killed
    assert not trial(tree, found["Sub7"], ["tests/test_reach.py::test_nothing"], 1.0).killed
    assert (tree / "src/lowalt/reach.py").read_text() == SOURCE
