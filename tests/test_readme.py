"""The README keeps its word: its code runs and gives the shapes it says, and the files it names exist."""

import re
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def test_the_library_example_runs_as_printed(monkeypatch):
    monkeypatch.chdir(ROOT)
    names: dict = {}
    exec(compile(re.search(r"```python\n(.*?)```", README, re.DOTALL)[1], "README.md", "exec"), names)
    shapes = {"signals": (3, 400), "velocity": (3, 256, 144), "time": (3, 1024, 392), "transfer": (123, 392)}
    assert {name: names[name].shape for name in shapes} == shapes
    assert names["tile"].shape == (768, 768)
    assert names["tile"].dtype == np.uint8
    assert len(np.unique(names["tile"])) > 100


def test_every_file_it_links_to_exists():
    links = re.findall(r"\]\(([^)#:]+)\)", README)
    assert len(links) >= 5
    missing = [link for link in links if not (ROOT / link).exists()]
    assert not missing
