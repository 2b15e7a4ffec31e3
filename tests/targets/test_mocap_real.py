"""Real recordings: known faults are refused and trimmed; those that walk or run become clouds."""

import pytest

from lowalt.files.errors import InputError
from lowalt.targets.skeleton import NODES
from real_inputs import FOLDER, needs_inputs
from walkers import cloud_of

FAULTS = {
    "07/07_12": ("frame 245 lacks .'ltoes'", {"last_frame": 244}),
    "09/09_10": ("frame 1 has an all-zero root", {"first_frame": 5}),
    "35/35_01": ("frame (99|100|101): .*(foot|toes|tibia) accelerates", {"first_frame": 104}),
    # It starts, walks and stops: no two frames are alike enough.
    "131/131_01": ("the best cycle, .* closes to 0.281 m", {"max_mismatch_m": 0.3}),
}
"""Recordings that are refused as they are, why, and the keys with which they become clouds."""


@needs_inputs
def test_every_real_recording_that_walks_or_runs_becomes_a_cloud_where_its_known_faults_are_left_out():
    paths = sorted((FOLDER / "cmu").glob("*/*.amc"))
    assert len(paths) >= 15
    for path in paths:
        subject, name = path.parent.name, f"{path.parent.name}/{path.stem}"
        record = {"skeleton": f"cmu/{subject}/{subject}.asf", "motion": f"cmu/{name}.amc"}
        message, trim = FAULTS.get(name, ("", {}))
        if message:
            with pytest.raises(InputError, match=rf"{path.name}: {message}"):
                cloud_of(FOLDER, **record)
        cloud = cloud_of(FOLDER, **record, **trim)
        assert 0.7 < cloud.record["track_speed_mps"] < 4.5
        track = cloud.track
        ahead = track[:, NODES.index("ltoes"), 1] - track[:, NODES.index("ltibia"), 1]
        assert ahead.mean() > 0 and track[:, NODES.index("lhipjoint"), 0].mean() < 0  # faces front, left is left
        assert track[:, NODES.index("head"), 2].mean() > 0.5
