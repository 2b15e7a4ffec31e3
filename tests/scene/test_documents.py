"""The code of the page on scenes runs as pasted, and shows the drone where it truly is."""

import re
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]


def test_the_page_on_scenes_shows_a_drone_over_a_town(monkeypatch, tmp_path):
    monkeypatch.chdir(ROOT)
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs/scenes.md").read_text(), re.DOTALL)
    names: dict = {}
    exec(code.replace('"map.png"', repr(str(tmp_path / "map.png"))), names)
    cube, settings = names["cube"], names["settings"]
    found = names["range_doppler"].definition(cube, settings)
    row, column = np.unravel_index(found.argmax(), found.shape)
    fold = names["speeds"][1]
    expected = (cube.truth[200, 1] + fold) % (2 * fold) - fold
    apart = abs(np.linspace(-fold, fold, 512)[column] - expected)
    assert abs(row - 32) <= 1 and min(apart, 2 * fold - apart) < 0.3
    assert (tmp_path / "map.png").is_file()
