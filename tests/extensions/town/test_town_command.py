"""The command `lowalt scene`: what it answers, and what it refuses."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from json_answers import answered
from lowalt.__main__ import main
from lowalt.config.layers import load
from lowalt.scene.checks import check
from towns import BOXES, ORIGIN, geojson

ROOT = Path(__file__).parents[3]
CONFIG = ROOT / "config/default.yaml"
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"


@pytest.fixture
def answer(capsys):
    """A function that runs a command line with --json; returns its answer and exit status."""
    return partial(answered, capsys)


def test_a_town_is_looked_at_and_its_scene_drafted(answer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    town = geojson(tmp_path / "blocks.geojson", BOXES)
    facts, status = answer("scene", "inspect", town, "--origin", *ORIGIN, "--material", "brick")
    assert status == 0 and facts["buildings"] == len(BOXES) and facts["walls"] == 4 * len(BOXES)
    assert (
        facts["materials"] == {"brick": 10 * len(BOXES)}
        and Path(facts["picture"]).stat().st_size > 5000
    )
    drafted, status = answer("scene", "new", town, "--out", "mine.yaml")
    assert status == 0 and (tmp_path / "mine.png").is_file()
    config = load([CONFIG, tmp_path / "mine.yaml"], SCHEMA)
    # Its middle is that of the stations.
    low, high = (np.array(drafted[key][:2]) for key in ("low_m", "high_m"))
    masts = [station["position_m"][:2] for station in config["network"]["stations"].values()]
    np.testing.assert_allclose((low + high) / 2, np.mean(masts, axis=0), atol=0.1)
    check(config)
    assert main(f"scene new {town} --out mine.yaml".split()) == 2
    assert main(f"scene inspect {town} --unit cubit".split()) == 2
