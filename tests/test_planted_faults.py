"""Planted faults: every one still has its place in the package, and a noticed one is told from one
that is not.
"""

import csv
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))
import planted_faults  # noqa: E402


def test_every_fault_of_the_table_can_be_planted_and_its_tests_are_there():
    with planted_faults.FAULTS.open(newline="") as file:
        faults = list(csv.DictReader(file))
    for fault in faults:
        assert (ROOT / fault["file"]).read_text().count(fault["old"]) == 1, fault
        for name in fault["tests"].split():
            planted_faults.test_file(ROOT, name)
    with (ROOT / "results/benchmarks/planted_faults.csv").open(newline="") as file:
        assert [row["fault"] for row in csv.DictReader(file)] == [
            fault["fault"] for fault in faults
        ]


@pytest.mark.parametrize(
    "law, by", [("sign(-2) < 0", "tests/test_law.py::test_law"), ("abs(sign(2)) > 0", "")]
)
def test_a_fault_is_caught_by_a_law_alone_and_taken_out_again(tmp_path, law, by):
    test = f"from signs import sign\n\n\ndef test_law():\n    assert {law}\n"
    for name, text in {
        "src/signs.py": "def sign(x):\n    return x\n",
        "tests/test_law.py": test,
    }.items():
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(text)
    fault = {
        "fault": "turned",
        "file": "src/signs.py",
        "old": "return x",
        "new": "return -x",
        "tests": "law",
    }
    assert planted_faults.planted(tmp_path, fault) == by
    assert (tmp_path / "src/signs.py").read_text() == "def sign(x):\n    return x\n"
    with pytest.raises(ValueError, match=r"signs.py: 'return y' stands there 0 times"):
        planted_faults.planted(tmp_path, fault | {"old": "return y"})
