"""The timed walk: its steps are the lines that the documents print, in their order, and a step that fails ends it."""

import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import walk

ROOT = Path(__file__).parents[1]


def test_every_step_stands_in_its_document_as_it_is_run():
    found = walk.steps()
    texts = {page: (ROOT / page).read_text() for page in ("README.md", *walk.TUTORIALS)}
    assert all(step.text in texts[step.document] for step in found)
    assert found[0] == walk.Step("README.md", "sh", "", "make")
    assert list(dict.fromkeys(step.document for step in found)) == ["README.md", *walk.TUTORIALS]
    for page in walk.TUTORIALS:
        places = [texts[page].index(step.text) for step in found if step.document == page]
        assert places == sorted(places)


def test_no_block_of_a_tutorial_is_left_out():
    found = walk.steps()
    for page in walk.TUTORIALS:
        mine = [step for step in found if step.document == page]
        blocks = (ROOT / page).read_text().split("\n```")
        opened = [block for block in blocks if block.startswith(("sh\n", "python", "yaml"))]
        commands = sum(len(block.splitlines()) - 1 for block in opened if block.startswith("sh\n"))
        others = sum(not block.startswith("sh\n") for block in opened)
        assert len(mine) == commands + others > 5


def test_what_a_step_must_show_belongs_to_a_step():
    assert set(walk.SHOWN) <= {step.text for step in walk.steps()}


def test_a_step_that_fails_or_shows_nothing_ends_the_walk(tmp_path, monkeypatch):
    (tmp_path / ".venv").symlink_to(sys.prefix)
    assert walk.walked(walk.Step("a", "file", "x.txt", "text"), tmp_path) >= 0
    assert (tmp_path / "x.txt").read_text() == "text"
    walk.walked(walk.Step("a", "python", "", "open('y.txt', 'w').write('y')"), tmp_path)
    assert (tmp_path / "y.txt").read_text() == "y"
    with pytest.raises(subprocess.CalledProcessError):
        walk.walked(walk.Step("a", "sh", "", "false"), tmp_path)
    with pytest.raises(subprocess.CalledProcessError):
        walk.walked(walk.Step("a", "python", "", "raise ValueError"), tmp_path)
    monkeypatch.setitem(walk.SHOWN, "true", ("x.txt", "not there"))
    with pytest.raises(SystemExit, match="not there"):
        walk.walked(walk.Step("a", "sh", "", "true"), tmp_path)
