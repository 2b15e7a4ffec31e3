"""Any number and names of stations: one, two and five go through every command, from signals to the page."""

import numpy as np
import pytest
import yaml

from chain import SIZE, SNRS, WAVE, recognised, reported, simulated
from lowalt.config.layers import load, merge
from lowalt.config.network import Network, station_names
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.recognition import schemes

NAMES = ("west", "A", "east", "B2", "north")
"""Not in alphabetical order, of one letter and of more."""
PLACES = {
    name: {"position_m": [100.0 * number, 20.0 * number, 25.0], "normal_deg": 60.0 + 10 * number}
    for number, name in enumerate(NAMES)
}


@pytest.mark.parametrize("count", [1, pytest.param(2, marks=pytest.mark.slow), 5])
def test_every_command_works_with_this_many_stations(tmp_path, count):
    pytest.importorskip("torch")
    network = WAVE | {"stations": {name: PLACES[name] for name in NAMES[:count]}}
    config = load(["config/default.yaml"], "workflow/schemas/config.schema.yaml") | {"run": "few", "network": network}
    config["noise"] = {"snr_db": SNRS}
    clouds = simulated(tmp_path, network)
    stations = sorted(NAMES[:count])
    signals = np.load(tmp_path / "noisy.npy")
    assert signals.shape == (20, 2, count, 24)
    # Rows of the tile are the stations, in the order in which their sub-bands follow each other.
    from lowalt.shards import ShardSet

    shards = ShardSet(tmp_path / "index.json")
    assert shards.tile(0).shape == (count * 32, 3 * 32)
    assert [station.name for station in Network.from_settings(network).stations] == stations
    name = recognised(tmp_path, network, config, clouds)
    views = np.load(tmp_path / "views-train.npz")["views"]
    assert views.shape == (24, 3 * count, SIZE, SIZE)
    if count > 1:
        assert not np.array_equal(views[:, :3], views[:, 3:6])
    (average,) = [line for line in read_csv(tmp_path / "accuracy.csv") if line["snr_db"] == "avg"]
    assert average["scheme"] == name and int(average["samples"]) == 8
    text = reported(tmp_path, config, clouds)
    assert f"{count} base station" in text and f"<td>{name}</td>" in text
    # A panel of the viewer for the echo and for each of the three spectra of each station.
    assert [text.count(f">{station}: ") for station in stations] == [4] * count


def test_a_station_of_the_layer_below_is_taken_out_and_a_scheme_must_name_known_ones(tmp_path):
    schema = "workflow/schemas/config.schema.yaml"
    overlay = {"network": {"stations": {"A": None, "C": None, "tower": PLACES["west"]}}}
    path = tmp_path / "overlay.yaml"
    path.write_text(yaml.safe_dump(overlay))
    config = load(["config/default.yaml", path], schema)
    assert station_names(config["network"]) == ["B", "tower"]
    empty = merge(config, {"network": {"stations": {"B": None, "tower": None}}})
    path.write_text(yaml.safe_dump(empty))
    with pytest.raises(InputError, match="stations"):
        load([path], schema)
    table = tmp_path / "schemes.csv"
    table.write_text(",".join(schemes.COLUMNS) + "\nboth,B+tower,VRP,mean,,seen\none,tower,VRP,mean,,seen\n")
    assert schemes.named(table, "both", ["B", "tower"]).stations == (0, 1)
    assert schemes.named(table, "one", ["B", "tower"]).stations == (1,)
    with pytest.raises(InputError, match=r"line 2: stations 'B\+tower', expected some of \('A', 'B'\)"):
        schemes.named(table, "both", ["A", "B"])
