"""Real recordings: known faults are refused and trimmed; those that walk or run become clouds."""

import pytest

from lowalt.files.errors import InputError
from lowalt.targets.skeleton import NODES
from real_inputs import FOLDER, needs_inputs
from walkers import cloud_of


@needs_inputs
def test_known_faults_of_real_recordings_are_refused_and_trimmed():
    faults = {
        "07/07_12": ("frame 245 lacks .'ltoes'", {"last_frame": 244}),
        "09/09_10": ("frame 1 has an all-zero root", {"first_frame": 5}),
        "35/35_01": ("frame (99|100|101): .*(foot|toes|tibia) accelerates", {"first_frame": 104}),
    }
    for name, (message, trim) in faults.items():
        subject = name.split("/")[0]
        record = {"skeleton": f"cmu/{subject}/{subject}.asf", "motion": f"cmu/{name}.amc"}
        with pytest.raises(InputError, match=message) as error:
            cloud_of(FOLDER, **record)
        assert f"{name}.amc" in str(error.value)
        cloud = cloud_of(FOLDER, **record, **trim)
        assert 0.7 < cloud.record["track_speed_mps"] < 4.5
        assert cloud.record["loop_mismatch_m"] < 0.1
        assert cloud.record["stance_foot_speed_mps"] < 1.0


@needs_inputs
def test_every_real_recording_that_walks_or_runs_becomes_a_cloud():
    trims = {"07_12": {"last_frame": 244}, "09_10": {"first_frame": 5}, "35_01": {"first_frame": 104}}
    paths = sorted((FOLDER / "cmu").glob("*/*.amc"))
    assert len(paths) >= 15
    for path in paths:
        subject = path.parent.name
        record = {"skeleton": f"cmu/{subject}/{subject}.asf", "motion": f"cmu/{subject}/{path.name}"}
        if path.stem == "131_01":  # it starts, walks and stops: no two frames are alike enough
            with pytest.raises(InputError, match=r"131_01.amc: the best cycle, .* closes to 0.281 m"):
                cloud_of(FOLDER, **record)
            record["max_mismatch_m"] = 0.3
        track = cloud_of(FOLDER, **record, **trims.get(path.stem, {})).track
        ahead = track[:, NODES.index("ltoes"), 1] - track[:, NODES.index("ltibia"), 1]
        assert ahead.mean() > 0 and track[:, NODES.index("lhipjoint"), 0].mean() < 0  # faces front, left is left
        assert track[:, NODES.index("head"), 2].mean() > 0.5
