"""The programs of the page on scenes run, and show the drone where it truly is."""

from pathlib import Path

import numpy as np

from lowalt.spectra.cube import TRUTH

ROOT = Path(__file__).parents[2]


def run(program: str, picture: str, folder: Path) -> dict:
    """The names that a program leaves which saves `picture`, saved into a folder instead."""
    code = (ROOT / "examples" / program).read_text()
    names: dict = {}
    exec(code.replace(f'"{picture}"', repr(str(folder / picture))), names)
    assert (folder / picture).is_file()
    return names


def test_the_page_on_scenes_shows_a_drone_over_a_town(monkeypatch, tmp_path):
    monkeypatch.chdir(ROOT)
    names = run("range_doppler_map.py", "map.png", tmp_path)
    cube = names["cube"]
    settings = names["settings"]
    found = names["range_doppler"].definition(cube, settings)
    row, column = np.unravel_index(found.argmax(), found.shape)
    fold = names["speeds"][1]
    expected = (cube.truth[200, 1] + fold) % (2 * fold) - fold
    apart = abs(np.linspace(-fold, fold, 512)[column] - expected)
    assert abs(row - 32) <= 1 and min(apart, 2 * fold - apart) < 0.3


def test_elements_as_links_show_the_drone_at_its_angle_and_range(monkeypatch, tmp_path):
    monkeypatch.chdir(ROOT)
    names = run("range_angle_map.py", "angle.png", tmp_path)
    row, cell = np.unravel_index(names["power"].argmax(), names["power"].shape)
    truth = names["cubes"][0].truth.mean(0)
    # Half the width of a beam of eight elements is 1/8; the target stays within two cells in a
    # second.
    assert abs(row / 32 - 1 - truth[TRUTH.index("psi")]) < 1 / 16
    assert abs(cell - truth[TRUTH.index("cell")]) <= 2
