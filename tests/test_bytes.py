"""The same bytes on every processor: a small data set in short, the whole tiny one against its manifest in full."""

import json
from pathlib import Path

import numpy as np
import pytest

from emulation import EMULATED, able, run
from lowalt.shards import build, manifest

ROOT = Path(__file__).parent.parent
REFERENCE = ROOT / "results/reference/tiny.sha256"
NAMES = [pytest.param(name, marks=pytest.mark.skipif(not able(name), reason=f"no {name} here")) for name in EMULATED]

PROBE = """
import hashlib, json, sys
import numpy as np
from lowalt.config.layers import load
from lowalt.numerics.streams import stream
from lowalt.motion.drawing import draw, region_polygon
from lowalt.noise.noisy_signals import noisy_signals
from lowalt.targets.make import make
from lowalt.targets.records import load_records
from lowalt.tiles.render import Renderer
from lowalt.tiles.png import encode

def digest(*arrays):
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()

config = load(["config/default.yaml"], "workflow/schemas/config.schema.yaml")
records = load_records(config["targets"]["table"], config["targets"]["records"])
found = {}
masts = np.array([place["position_m"][:2] for place in config["network"]["stations"].values()])
corners = region_polygon(masts, None)
for name in ("DJI Avata", "Kingfisher", "Audi A6L 2019", "Running Pedestrian 1"):
    cloud = make(records[name], None, 7)
    found[f"cloud of {name}"] = digest(cloud.points, cloud.normals, cloud.hinges, cloud.axes, cloud.track)
    rng = stream(7, "motion", name, 0)
    row = draw(rng, cloud, records[name]["published"], masts, corners, config["motion"]) | {"model": 0}
    found[f"motion of {name}"] = json.dumps(row, sort_keys=True)
time = np.arange(400) / 400
clean = np.stack([np.exp(2j * np.pi * (np.rint(99 * k * time) / 400)).round(6) for k in (1, 2, 3)])
noisy = noisy_signals(clean[:, None].astype(np.complex64), [row], ["A", "B", "C"], [3.0, 23.0], 7)
found["noise"] = digest(noisy)
tiles = Renderer.from_settings({key: config[key] for key in ("network", "spectra", "images")})
for level, sample in enumerate(noisy[0]):
    found[f"tile {level}"] = hashlib.sha256(encode(tiles.tile(sample), tiles.images.palette)).hexdigest()
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def here():
    return json.loads(run("native", "-c", PROBE))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES[:2])
def test_clouds_motion_noise_and_tiles_are_those_of_another_processor(name, here):
    found = json.loads(run(name, "-c", PROBE))
    assert {stage for stage in here if found[stage] != here[stage]} == set()


SMALL = """
targets: {select: [DJI Mini 2, Owl, Audi A6L 2019, Running Pedestrian 1]}
motion: {models: 1, models_per_chunk: 1}
split: {by: motion, train: 1, val: 0, test: 0}
shards: {kind: signal}
"""


def test_signals_of_a_small_data_set_are_those_of_another_processor(tmp_path):
    """Clouds, motion tables, shards, their tables and the index, on the processor that can do least."""
    (tmp_path / "small.yaml").write_text(SMALL)
    config = "--config", "config/default.yaml", "config/tiny.yaml", str(tmp_path / "small.yaml")
    build.main([*config, "--out", str(tmp_path / "here")])
    run("x86-64-v2", "-m", "lowalt.shards.build", *config, "--out", str(tmp_path / "there"))
    expected = manifest.text(tmp_path / "here")
    assert expected.count("\n") == 4 + 2 + 2 * 2 + 1 and manifest.text(tmp_path / "there") == expected


SCENE = """
import sys
import numpy as np
from lowalt.config.layers import load
from lowalt.shards.dataset import Dataset
found = []
for scene in ("urban", "worst"):
    config = load(["config/default.yaml", f"config/scenes/{scene}.yaml"], "workflow/schemas/config.schema.yaml")
    config["targets"]["select"] = ["Owl"]
    # Surfaces would have to be made first.
    config["effects"].pop("occlusion", None)
    dataset = Dataset(config)
    found.append(dataset.maker.signal(dataset.row(dataset.place(0)), np.inf))
np.save(sys.argv[1], np.stack(found))
"""


@pytest.mark.slow
def test_signals_of_scenes_agree_but_for_the_last_bit_of_few(tmp_path):
    """No promise of bytes here: this holds what `design/bytes.md` says of scenes with effects."""
    for name in ("native", "x86-64-v2"):
        run(name, "-c", SCENE, str(tmp_path / f"{name}.npy"))
    here, there = (np.load(tmp_path / f"{name}.npy") for name in ("native", "x86-64-v2"))
    assert here.shape == (2, 3, 400) and abs(here).min(axis=(1, 2)).max() > 0
    assert (here != there).mean() < 0.1
    assert (abs(here - there).max(axis=(1, 2)) < 2e-7 * abs(here).max(axis=(1, 2))).all()


def test_emulation_leaves_instructions_out():
    """Without this the tests above would compare a processor with itself."""
    program = "import numpy as np, json; from numba.core.registry import cpu_target as t;"
    program += "from numpy._core._multiarray_umath import __cpu_features__ as f;"
    program += "print(json.dumps([bool(f.get('X86_V3', f['FMA3'])), t.target_context.codegen().magic_tuple()[1]]))"
    fused, name = json.loads(run("x86-64-v2", "-c", program))
    assert not fused and name == "nehalem"


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("name", ["native", *NAMES])
def test_the_tiny_data_set_has_the_bytes_of_its_manifest(name, threads, tmp_path):
    config = ("config/default.yaml", "config/tiny.yaml")
    run(name, "-m", "lowalt.shards.build", "--config", *config, "--out", str(tmp_path / "run"), threads=threads)
    # Echoes and noisy signals stay in memory here; the shards follow from them.
    assert manifest.faults(REFERENCE, tmp_path / "run", ("echo", "noise", "tiles")) == []
