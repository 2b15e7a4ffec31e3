"""The shipped networks of radars: each is that of the twin of its radar."""

from dataclasses import asdict
from pathlib import Path

import pytest

from lowalt.extensions.formats import zoo
from lowalt.extensions.recordings.twin import radars, records
from lowalt.recognition import model_file, runs

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("name", ["uav_3ghz", "bird_drone_10ghz", "cw_24ghz"])
def test_the_shipped_entries_of_radars_are_those_of_the_twins_there_are(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    path = zoo.ZOO / f"{name}.safetensors"
    assert (
        path.stat().st_size < zoo.LARGEST_BYTES and model_file.read(path).measured["percent"] > 80
    )
    assert model_file.read(path).identity["settings"]["table"] == "config/schemes.csv"
    made = runs.opened(name)[1]
    radar = made["radar"]
    caution = records()[name].twin["caution"]
    assert radar == asdict(radars()[name]) and made["caution"] == caution
    card = path.with_suffix(".md").read_text()
    assert (
        f"{caution[1:]}.\n" in card
        and f"It classifies {made['expected']['percent']:.1f} % of" in card
    )
    assert (
        f"a radar of {radar['carrier_hz'] / 1e9:g} GHz" in card
        and f"lowalt predict {name} recording.yaml" in card
    )
