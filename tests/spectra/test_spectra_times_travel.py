"""The instants of late symbols travel with the samples.

All kinds of shards and the tiles stage give the tiles of the made sample.
"""

import json

import numpy as np
import pytest

from lowalt.config.layers import canonical
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.motion import write_table
from lowalt.scene.checks import check
from lowalt.scene.effects import called
from lowalt.scene.lateness import late_effects, lateness
from lowalt.scene.observe import Scene, observe
from lowalt.shards import ShardSet
from lowalt.shards.build import rows_of, write_run
from lowalt.shards.dataset import Dataset
from lowalt.tiles.__main__ import main as tiles
from lowalt.tiles.tile_files import Tiles
from small_configuration import configuration

FRAMES = {"slow_time": {"downlink": 0.75, "missing": 0.2, "jitter_s": 1e-3, "regrid": "zero"}}


@pytest.fixture(scope="module")
def dataset():
    config = configuration(effects=FRAMES)
    config["targets"]["select"] = ["DJI Mini 2"]
    config["motion"] |= {"models": 2, "models_per_chunk": 2}
    config["split"] = {"by": "motion", "train": 1, "val": 0, "test": 1}
    config["noise"] = {"snr_db": [float("inf")]}
    config["network"] |= {"symbols": 100}
    config["spectra"]["vrp"] |= {"window": 64, "points": 64}
    config["spectra"]["trp"] |= {"points": 64}
    config["spectra"] = {"times": "known", **config["spectra"]}
    config["images"] |= {"size": 32}
    return Dataset(config)


def test_lateness_is_what_the_effect_drew(dataset):
    network = Network.from_settings(dataset.config["network"])
    row = dataset.row(dataset.place(0))
    found = lateness({"times": "known"}, FRAMES, network, dataset.plan.seed, row)
    scene = Scene(network, dataset.plan.seed, None, tuple(called(FRAMES)))
    for station, late in zip(network.stations, found, strict=True):
        view = observe(scene, station, dataset.clouds[row["subtype"]], row)
        drawn = (view.times_s - network.times_s) / network.symbol_interval_s
        assert late == pytest.approx(drawn, abs=1e-12) and 0.3 < late.max() <= 0.4
    assert (
        lateness({}, FRAMES, network, 1, row) is None
        and lateness({"times": "known"}, {}, network, 1, row) is None
    )
    assert late_effects(dataset.config) == FRAMES and not late_effects(
        dataset.config | {"effects": {}}
    )


def test_every_kind_of_shards_gives_the_tiles_of_the_made_sample(dataset, tmp_path):
    made = {dataset.key(number): dataset.tile(number) for number in range(len(dataset))}
    for kind in ("signal", "image"):
        write_run(dataset, tmp_path / kind, kind)
        shards = ShardSet(tmp_path / kind / "shards/index.json")
        for number, key in enumerate(shards.keys.tolist()):
            assert (shards.tile(number) == made[key.decode()]).all()
        if kind == "signal":
            on_time = shards.renderer.tile(shards.signal(0))
            assert (on_time != shards.tile(0)).mean() > 0.2
            assert (
                np.abs(shards.images(0, views=["trp"])[0].astype(int) - shards.tile(0)[:32, 32:64])
                == 0
            ).all()


def test_the_tiles_stage_draws_the_instants_of_its_motion_table(dataset, tmp_path):
    chunk = next(iter(dataset.plan.chunks))
    rows = rows_of(dataset, chunk)
    write_table(tmp_path / "motion.csv", rows)
    signals = np.stack([dataset.maker.signal(row, float("inf"))[None] for row in rows])
    np.save(tmp_path / "noisy.npy", signals)
    block = {name: dataset.config[name] for name in ("network", "spectra", "images")}
    drawn = {"drawn": {"seed": dataset.plan.seed, "effects": FRAMES}}
    files = "--signals", str(tmp_path / "noisy.npy"), "--motion", str(tmp_path / "motion.csv")
    tiles(
        ["--settings", canonical({**block, **drawn}), *files, "--out", str(tmp_path / "tiles.npz")]
    )
    found = Tiles(tmp_path / "tiles.npz")
    assert [found[number] for number in range(len(rows))] == [
        dataset.maker.png(signal[0], row, np.inf) for signal, row in zip(signals, rows, strict=True)
    ]


def test_a_signal_that_was_made_even_is_refused(dataset):
    even = {"slow_time": FRAMES["slow_time"] | {"regrid": "nudft"}}
    with pytest.raises(InputError, match=r"slow_time.regrid: 'nudft'.*expected 'zero'"):
        check(json.loads(json.dumps(dataset.config | {"effects": even})))
    check(json.loads(json.dumps(dataset.config)))
