"""Every effect alone, and whole scenes, on two processors: how far their numbers are apart."""

import numpy as np
import pytest

from emulation import EMULATED, able, run
from lowalt.scene.effects import PLACES

NAMES = [
    pytest.param(name, marks=pytest.mark.skipif(not able(name), reason=f"no {name} here"))
    for name in EMULATED
]
CLOSE = 2e-7
"""Largest difference, relative to the largest value: three units in the last place of float32."""

PROBE = """
import sys
import numpy as np
from lowalt.config.layers import load
from lowalt.scene.effects import PLACES
from lowalt.shards.dataset import Dataset
from lowalt.targets.occluders import make
from lowalt.targets.records import records_of
config = load(["config/default.yaml"], "workflow/schemas/config.schema.yaml")
names = config["targets"]["select"] = ["DJI Mini 2", "Owl"]
config["effects"] = {}
records = records_of(config["targets"], None)
occluders = {name: make(records[name], None, config["seed"]) | {"subtype": name} for name in names}
SETTINGS = {"town": {"buildings": "studies/town/blocks.geojson", "origin": [11.575, 48.137]}}
clouds, found = Dataset(config).clouds, {}
for name in ["none", *PLACES]:
    settings = SETTINGS.get(name, {})
    dataset = Dataset(config | {"effects": {} if name == "none" else {name: settings}}, clouds, occluders=occluders)
    rows = [dataset.row(dataset.place(number)) for number in (0, len(dataset) // 2)]
    found[name] = np.stack([dataset.maker.signal(row, np.inf) for row in rows])
np.savez(sys.argv[1], **found)
"""


@pytest.fixture(scope="module")
def signals(tmp_path_factory):
    """Signals of every effect by name, native and without AVX: (2 targets, 3 stations, symbols)
    complex64 each.
    """
    folder = tmp_path_factory.mktemp("effects")
    for name in ("native", "x86-64-v2"):
        run(name, "-c", PROBE, str(folder / f"{name}.npz"))
    here, there = (np.load(folder / f"{name}.npz") for name in ("native", "x86-64-v2"))
    return {name: (here[name], there[name]) for name in here.files}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["none", *PLACES])
def test_an_effect_gives_the_numbers_of_another_processor(signals, name):
    here, there = signals[name]
    assert abs(here).max() > 0
    if name == "none":
        assert (here == there).all()
    assert abs(here - there).max() <= CLOSE * abs(here).max()


SCENE = """
import sys
import numpy as np
from lowalt.config.layers import overlaid
from lowalt.shards.dataset import Dataset
found = []
for scene in ("urban", "worst"):
    config = overlaid([f"config/scenes/{scene}.yaml"])
    config["targets"]["select"] = ["Owl"]
    # Surfaces would have to be made first.
    config["effects"].pop("occlusion", None)
    dataset = Dataset(config)
    found.append(dataset.maker.signal(dataset.row(dataset.place(0)), np.inf))
np.save(sys.argv[1], np.stack(found))
"""


@pytest.mark.slow
def test_signals_of_scenes_agree_but_for_the_last_bit_of_few(tmp_path):
    for name in ("native", "x86-64-v2"):
        run(name, "-c", SCENE, str(tmp_path / f"{name}.npy"))
    here, there = (np.load(tmp_path / f"{name}.npy") for name in ("native", "x86-64-v2"))
    assert here.shape == (2, 3, 400) and abs(here).min(axis=(1, 2)).max() > 0
    assert (here != there).mean() < 0.1
    assert (abs(here - there).max(axis=(1, 2)) < CLOSE * abs(here).max(axis=(1, 2))).all()
