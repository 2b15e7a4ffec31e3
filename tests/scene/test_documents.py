"""The code of the page on scenes runs as pasted, and gives a sample in every form."""

import re
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]


def test_the_page_on_scenes_gives_all_of_a_sample(monkeypatch):
    monkeypatch.chdir(ROOT)
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs/scenes.md").read_text(), re.DOTALL)
    names: dict = {}
    exec(code, names)
    assert names["response"].shape == names["cells"].shape == names["range_doppler"].shape == (400, 256)
    # The drone moves, so its power behind the canceller does not lie at zero Doppler.
    doppler = (abs(names["range_doppler"]) ** 2).sum(axis=1)
    assert abs(int(doppler.argmax()) - 200) > 1
    assert names["signal"].shape == (400,) and np.isfinite(names["signal"]).all()
