"""Studies: each says what it is, its commands start, its configurations fit the schema, and nothing imports it."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from lowalt.config.layers import load

ROOT = Path(__file__).parent.parent
# As `studies/study.mk` sets it, and the sources of this checkout.
ENVIRONMENT = os.environ | {"PYTHONPATH": f"{ROOT / 'src'}{os.pathsep}{ROOT / 'studies'}"}
STUDIES = sorted(path.parent for path in (ROOT / "studies").glob("*/Makefile"))


def commands(study: Path) -> list[list[str]]:
    """The commands that `make` runs in a study's folder."""
    said = subprocess.run(["make", "-n", "-C", study], capture_output=True, text=True, check=True).stdout.replace(
        "\\\n", ""
    )
    return [shlex.split(part) for line in said.splitlines() for part in re.split("&&|;", line) if "studies/" in part]


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_a_study_says_what_it_is_and_its_configurations_fit_the_schema(study):
    assert len((study / "README.md").read_text().splitlines()) <= 60
    asked = commands(study)
    assert asked
    for words in asked:
        if "--configfile" in words:
            rest = words[words.index("--configfile") + 1 :]
            files = rest[: next((place for place, word in enumerate(rest) if word.startswith("--")), len(rest))]
            files = [name for name in files if "$" not in name]
            load(["config/default.yaml", *files], "workflow/schemas/config.schema.yaml")
        missing = [word for word in words if word.startswith("studies/") and Path(word).suffix in (".py", ".yaml")
                   and not (ROOT / word).is_file()]  # fmt: skip
        assert not missing


@pytest.mark.parametrize(
    "study", [one for one in STUDIES if (one / "study.py").is_file()], ids=lambda study: study.name
)
def test_a_study_s_command_starts(study):
    said = subprocess.run(
        [sys.executable, study / "study.py", "--help"], cwd=ROOT, capture_output=True, text=True, env=ENVIRONMENT
    )
    # A program with several commands names them, with exit status 2.
    assert said.returncode in (0, 2) and "Traceback" not in said.stderr, said.stderr


def test_nothing_imports_a_study():
    names = {path.stem for path in (ROOT / "studies").rglob("*.py")} - {"study"}
    pattern = re.compile(rf"^\s*(?:from|import) (?:studies|{'|'.join(names)})\b", re.MULTILINE)
    assert not [path.name for path in (ROOT / "src").rglob("*.py") if pattern.search(path.read_text())]
