"""Distances between recordings and scenes: which scenes are compared, and what a row says where a half is missing."""

import numpy as np
from scipy.io import wavfile

from lowalt.files.yaml_files import load_yaml
from lowalt.recordings.compare import DISTANCES, distances
from lowalt.recordings.figures import INTERVAL
from lowalt.recordings.library import Library
from lowalt.recordings.sets import recordings


def libraries():
    """The scenes that networks learn from, and those as they were recorded."""
    return [Library.read(f"config/measured/{name}.yaml") for name in ("twins", "recorded")]


def test_scenes_as_recorded_lie_over_those_that_networks_learn_from():
    learnt, recorded = libraries()
    assert recorded.twins == learnt.twins and recorded.sets == learnt.sets and recorded.seed == learnt.seed
    kinds = {
        name: {block["label"] for block in blocks} for name, blocks in load_yaml("config/measured/sets.yaml").items()
    }
    for twin, sets in recorded.sets.items():
        held = set().union(*(kinds[name] for name in sets))
        for category, scenes in recorded.scenes[twin].items():
            plain = [{key: item for key, item in scene.items() if key != "receiver"} for scene in scenes]
            own = [
                {key: item for key, item in scene.items() if key != "receiver"}
                for scene in learnt.scenes[twin][category]
            ]
            assert (plain == own) == (category not in held)
    # A scene's own receiver settings lie over its twin's.
    drone, bird = (recorded.scenes["bird_drone_10ghz"][name][0]["receiver"] for name in ("UAV", "Bird"))
    assert drone["hum_db"] != bird["hum_db"] and drone["snr_db"] == bird["snr_db"]


def test_distances_of_one_test_recording_have_no_floor_and_stand_next_to_simulated_classes(tmp_path):
    (tmp_path / "walker_24ghz").mkdir()
    time = np.arange(12000) / 12000
    wave = np.cos(2 * np.pi * 200.0 * time) * (time > 0.3) + 0.01 * np.random.default_rng(0).standard_normal(12000)
    wavfile.write(tmp_path / "walker_24ghz/new.wav", 12000, (10000 * wave).astype(np.int16))
    found = recordings(tmp_path, "config/measured/sets.yaml", "config/measured/split.yaml")
    learnt, recorded = libraries()
    rows = [
        dict(zip(DISTANCES, row, strict=True))
        for row in distances("cw_24ghz", found, learnt, recorded, ["texture_db"], 1)
    ]
    assert [row["figure"] for row in rows] == list(INTERVAL)
    for row in rows:
        assert np.isnan(row["floor"]) and np.isnan(row["tuning"]) and row["test"] == row["distance"] >= 0
        assert row["label"] == "Pedestrian" and row["ceiling_class"].endswith(", simulated")
    assert any(row["learnt"] != row["distance"] for row in rows)
    assert distances("uav_3ghz", found, learnt, recorded, ["texture_db"], 1) == []
