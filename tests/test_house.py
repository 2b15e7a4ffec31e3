"""The house: one street in one direction, light entrances, and nothing in the repository that does not belong there."""

import ast
import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lowalt.common.street import PACKAGE, STREET, modules, rooms_imported
from lowalt.report.figures import house

ROOT = Path(__file__).parent.parent
STAGES = [name for name in STREET if name not in ("common", "measure", "workflow", "commands")]


@pytest.mark.parametrize("stage", STREET)
def test_a_stage_imports_only_what_stands_before_it(stage):
    allowed = set(STREET[: STREET.index(stage) + 1])
    files = modules(stage)
    assert files
    wrong = {path.name: rooms_imported(path) - allowed for path in files if rooms_imported(path) - allowed}
    assert not wrong


@pytest.mark.parametrize("stage", [stage for stage in STAGES if stage not in ("spectra", "recognition")])
def test_who_only_wants_data_never_imports_torch(stage):
    program = f"import sys, lowalt.{stage}.__main__; print('torch' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


def test_the_street_holds_every_room():
    assert {path.parent.name for path in PACKAGE.glob("*/__init__.py")} == set(STREET)


def test_the_picture_of_the_house_has_a_mark_for_every_import_between_rooms():
    rows, columns = house.imports()
    assert ("measure", "recognition") in zip(rows, columns, strict=True)
    assert not {(room, other) for room, other in zip(rows, columns, strict=True) if room == "common"}
    picture = np.asarray(Image.open(io.BytesIO(house.draw())).convert("L"))
    assert picture.min() < 100 < 250 < picture.max()


def test_every_module_says_what_it_holds():
    bare = [path for path in PACKAGE.rglob("*.py") if not ast.get_docstring(ast.parse(path.read_text()))]
    assert not bare


def python_files(*folders: str) -> list[Path]:
    """The Python files below these folders of the repository."""
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def functions(path: Path) -> list[ast.FunctionDef]:
    """All functions of a file, with those inside classes and other functions."""
    return [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)]


def test_every_function_says_what_it_does():
    bare = [
        f"{path.name}: {node.name}"
        for path in python_files("src", "benchmarks", "tests/support")
        for node in functions(path)
        if not node.name.startswith("__") and not ast.get_docstring(node)
    ]
    assert not bare


LONG = {
    "one_way": "a compiled loop over points and frequencies; functions for its parts would take ten numbers a point",
    "triangles": "a compiled loop over points and triangles; functions for its parts would take ten numbers a pair",
}
"""Functions that may have more than 60 lines, with the reason."""


def test_functions_have_at_most_60_lines_and_files_250():
    files = python_files("src", "benchmarks", "tests", "docs", "examples")
    lines = {path.relative_to(ROOT): len(path.read_text().splitlines()) for path in files}
    long = [f"{path.name}: {node.name}" for path in files for node in functions(path)
            if node.end_lineno - node.lineno >= 60 and node.name not in LONG]  # fmt: skip
    assert not long
    assert not {str(path): count for path, count in lines.items() if count > 250}


def test_no_name_of_a_class_stands_for_two_things():
    defined = [node.name for path in python_files("src/lowalt") for node in ast.parse(path.read_text()).body
               if isinstance(node, ast.ClassDef)]  # fmt: skip
    assert not {name for name in defined if defined.count(name) > 1}


def test_no_tracked_file_is_large_or_names_this_machine():
    tracked = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if tracked.returncode:
        pytest.skip("not a git checkout")
    files = [ROOT / name for name in tracked.stdout.split("\0") if name]
    files = [path for path in files if path.is_file()]
    assert files
    assert not [path for path in files if path.stat().st_size > 1_000_000]
    home = "/" + "work/"
    named = [path for path in files if path.suffix != ".png" and home in path.read_text(errors="replace")]
    assert not named
