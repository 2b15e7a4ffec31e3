"""The instants of late symbols travel with the samples.

All kinds of shards and the tiles stage give the tiles of the made sample.
"""

import json

import pytest

from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.scene.checks import check
from lowalt.scene.effects import called
from lowalt.scene.lateness import late_effects, lateness
from lowalt.scene.observe import Scene, observe
from lowalt.shards import ShardSet
from lowalt.shards.dataset import Dataset
from small_configuration import configuration
from stage_runs import check_members, run_stages

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


@pytest.mark.parametrize("kind", ["signal", "image"])
def test_shards_of_the_stages_give_the_tiles_of_the_made_sample(kind, dataset, tmp_path):
    shards = ShardSet(run_stages(dataset, tmp_path, kind))
    check_members(dataset, shards)
    numbers = {dataset.key(number): number for number in range(len(dataset))}
    for number, key in enumerate(shards.keys.tolist()):
        assert (shards.tile(number) == dataset.tile(numbers[key.decode()])).all()
    if kind == "signal":
        on_time = shards.renderer.tile(shards.signal(0))
        assert (on_time != shards.tile(0)).mean() > 0.2
        (alone,) = shards.images(0, stations=["A"], views=["trp"])
        assert (alone == shards.tile(0)[:32, 32:64]).all()


def test_a_signal_that_was_made_even_is_refused(dataset):
    even = {"slow_time": FRAMES["slow_time"] | {"regrid": "nudft"}}
    with pytest.raises(InputError, match=r"slow_time.regrid: 'nudft'.*expected 'zero'"):
        check(json.loads(json.dumps(dataset.config | {"effects": even})))
    check(json.loads(json.dumps(dataset.config)))
