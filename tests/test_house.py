"""The house: one street in one direction, light entrances, and nothing in the repository that does not belong there."""

import ast
import io
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from forks import printed
from lowalt.common.street import PACKAGE, STREET, modules, rooms_imported
from lowalt.effects.catalogue import PLACES
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


def test_who_only_wants_data_never_imports_torch():
    stages = [stage for stage in STAGES if stage not in ("spectra", "recognition")]
    found = printed([f"import sys, lowalt.{stage}.__main__; print('torch' in sys.modules)" for stage in stages])
    assert dict(zip(stages, found, strict=True)) == dict.fromkeys(stages, "False\n")


def test_what_no_scene_names_is_not_imported():
    scenes = [{}, *({name: {}} for name in PLACES)]
    program = (
        "import os, sys, lowalt.echo.__main__, lowalt.effects.__main__, lowalt.noise.__main__\n"
        "from lowalt.effects.catalogue import called\n"
        f"for scene in {scenes!r}:\n"
        "    if os.fork() == 0:\n"
        "        called(scene)\n"
        "        break\n"
        "    os.wait()\n"
        "else:\n"
        "    sys.exit()\n"
        "names = [n for n in sys.modules if n.startswith('lowalt.effects.') and n.count('.') == 3]\n"
        "print(*(n.rpartition('.')[2] for n in names), flush=True)\n"
        "os._exit(0)"
    )
    (text,) = printed([program])
    found = [{other for other in line.split() if other in PLACES} for line in text.split("\n")[:-1]]
    assert found == [set(scene) for scene in scenes]


def test_a_run_without_effects_imports_nothing_of_them():
    program = "import sys, lowalt.echo.__main__, lowalt.noise.__main__; print('lowalt.effects' in sys.modules)"
    assert printed([program]) == ["False\n"]


def test_the_street_holds_every_room():
    assert {path.parent.name for path in PACKAGE.glob("*/__init__.py")} == set(STREET)


def test_the_picture_of_the_house_has_a_mark_for_every_import_between_rooms():
    pairs = set(zip(*house.imports(), strict=True))
    assert ("measure", "recognition") in pairs
    assert not {(room, other) for room, other in pairs if room == "common"}
    picture = np.asarray(Image.open(io.BytesIO(house.draw())).convert("RGB")).astype(int)
    # Dots are the only thing in colour. The first column of dots is that of the room `common`.
    dots, count = ndimage.label(picture[..., 2] - picture[..., 0] > 40)
    centres = np.array(ndimage.center_of_mass(dots > 0, dots, range(1, count + 1)))
    # The first room imports none, and none imports the last.
    places = (centres - centres.min(axis=0)) / np.ptp(centres, axis=0) * (len(STREET) - 2)
    found = [(STREET[row + 1], STREET[column]) for row, column in np.rint(places).astype(int).tolist()]
    assert sorted(found) == sorted(pairs)


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
