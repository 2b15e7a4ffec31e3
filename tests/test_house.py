"""The house: one street in one direction, light entrances, and nothing in the repository that does not belong there."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from lowalt.workflow.sources import PACKAGE

ROOT = Path(__file__).parent.parent
STREET = [
    "common", "targets", "motion", "echo", "effects", "noise", "spectra", "tiles", "shards", "recognition", "measure",
    "report", "workflow",
]  # fmt: skip
STAGES = [name for name in STREET if name not in ("common", "measure", "workflow")]


def stages_imported(path: Path) -> set[str]:
    """Stage folders that a file's imports name."""
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module == "lowalt":
            names += [f"lowalt.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.append(node.module)
    parts = [name.split(".") for name in names]
    return {part[1] for part in parts if part[0] == "lowalt" and len(part) > 1 and part[1] in STREET}


@pytest.mark.parametrize("stage", STREET)
def test_a_stage_imports_only_what_stands_before_it(stage):
    allowed = set(STREET[: STREET.index(stage) + 1])
    files = sorted((PACKAGE / stage).rglob("*.py"))
    assert files
    wrong = {path.name: stages_imported(path) - allowed for path in files if stages_imported(path) - allowed}
    assert not wrong


@pytest.mark.parametrize("stage", [stage for stage in STAGES if stage not in ("spectra", "recognition")])
def test_who_only_wants_data_never_imports_torch(stage):
    program = f"import sys, lowalt.{stage}.__main__; print('torch' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


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
