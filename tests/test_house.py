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
