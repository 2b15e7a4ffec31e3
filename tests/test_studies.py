"""Studies: each says what it is, its commands start, its configurations fit the schema, and nothing
imports it.
"""

import re
import shlex
import subprocess
from pathlib import Path

import pytest

from forks import ended
from lowalt.config.layers import load

ROOT = Path(__file__).parent.parent
STUDIES = sorted(path.parent for path in (ROOT / "studies").glob("*/Makefile"))


def commands(study: Path) -> list[list[str]]:
    """The commands that `make` runs in a study's folder."""
    said = subprocess.run(
        ["make", "-n", "-C", study], capture_output=True, text=True, check=True
    ).stdout.replace("\\\n", "")
    return [
        shlex.split(part)
        for line in said.splitlines()
        for part in re.split("&&|;", line)
        if "studies/" in part
    ]


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_a_study_says_what_it_is_and_its_configurations_fit_the_schema(study):
    assert len((study / "README.md").read_text().splitlines()) <= 60
    asked = commands(study)
    assert asked
    for words in asked:
        if "--configfile" in words:
            rest = words[words.index("--configfile") + 1 :]
            files = rest[
                : next(
                    (place for place, word in enumerate(rest) if word.startswith("--")), len(rest)
                )
            ]
            files = [name for name in files if "$" not in name]
            load(["config/default.yaml", *files], "workflow/schemas/config.schema.yaml")
        missing = [
            word
            for word in words
            if word.startswith("studies/")
            and Path(word).suffix in (".py", ".yaml")
            and not (ROOT / word).is_file()
        ]
        assert not missing


def test_the_command_of_each_study_starts():
    paths = [str(study / "study.py") for study in STUDIES if (study / "study.py").is_file()]
    # The folders that Python and `studies/study.mk` put first.
    start = (
        "import runpy, sys; sys.path[:0] = {!r}; sys.argv = {!r}; runpy.run_path(sys.argv[0],"
        " run_name='__main__')"
    )
    folders = [str(ROOT / "src"), str(ROOT / "studies")]
    programs = [
        start.format([str(Path(path).parent), *folders], [path, "--help"]) for path in paths
    ]
    for path, (status, said, complaint) in zip(
        paths, ended(programs, "torch", "timm"), strict=True
    ):
        # A program with several commands names them, with exit status 2.
        assert status in (0, 2) and "Traceback" not in complaint, (path, complaint)
        given = re.findall(r"study\.py(.*)", Path(path).with_name("Makefile").read_text())
        options = set(re.findall(r"--[a-z-]+", " ".join(given)))
        assert status == 2 or not [option for option in options if option not in said], path
    assert len(paths) > 5


def test_nothing_imports_a_study():
    names = {path.stem for path in (ROOT / "studies").rglob("*.py")} - {"study"}
    pattern = re.compile(rf"^\s*(?:from|import) (?:studies|{'|'.join(names)})\b", re.MULTILINE)
    assert not [
        path.name for path in (ROOT / "src").rglob("*.py") if pattern.search(path.read_text())
    ]
