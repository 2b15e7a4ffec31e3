"""The README keeps its word: its code runs and gives the shapes it says."""

import re
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def test_the_library_example_runs_as_printed(monkeypatch):
    monkeypatch.chdir(ROOT)
    names: dict = {}
    exec(
        compile(re.search(r"```python\n(.*?)```", README, re.DOTALL)[1], "README.md", "exec"), names
    )
    image = names["image"]
    signal = names["signal"]
    assert (image.shape, image.dtype) == ((768, 768), np.uint8)
    assert (signal.shape, signal.dtype) == ((3, 400), np.complex64)
    assert names["record"]["category"] == names["samples"].classes[names["label"]]
    assert len(np.unique(image)) > 100


def test_it_fits_two_screens():
    assert len(README.splitlines()) < 80
