"""Surfaces of a data set made on the spot: made where the scene hides points, and only there."""

import numpy as np

from lowalt.shards.dataset import Dataset
from lowalt.targets import occluders
from lowalt.targets.records import records_of
from small_configuration import configuration


def config_of(*subtypes: str, **effects: dict) -> dict:
    """One motion model a fold of the subtypes, without noise, in a scene with these effects."""
    config = configuration(effects=effects)
    config["targets"]["select"] = list(subtypes)
    config["noise"] = {"snr_db": [np.inf]}
    return config


def test_a_scene_that_hides_points_is_made_with_the_surfaces_that_its_run_would_read(tmp_path):
    config = config_of("DJI Mini 2", "Walking Pedestrian 5", occlusion={})
    records = records_of(config["targets"], None)
    for number, name in enumerate(config["targets"]["select"]):
        occluders.write(
            tmp_path / f"{number}.npz", occluders.make(records[name], None, config["seed"]), name
        )
    given = Dataset(config, occluders=occluders.read_all(sorted(tmp_path.glob("*.npz"))))
    made = Dataset(config)
    open_sky = Dataset(config_of("DJI Mini 2", "Walking Pedestrian 5"))
    for number in range(0, len(made), 3):
        np.testing.assert_array_equal(made.signal(number), given.signal(number))
        assert not np.array_equal(made.signal(number), open_sky.signal(number))
