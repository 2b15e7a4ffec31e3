"""Records of samples: motion, geometry and versions, one type a field, and keys."""

import io
import json
import math
import tarfile
from types import SimpleNamespace

import pytest

from dataset import SEED, motion_rows
from forks import printed
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.shards.sample_list import sample_key, slug_of, snr_label
from lowalt.shards.sample_record import DATA_VERSION, geometry, record, row_of
from lowalt.shards.tar import Writer
from pictures import NETWORK


def test_record_tells_motion_geometry_and_versions():
    row = motion_rows("seen")[0]
    row.update(x_m=30.0, y_m=40.0, z_m=25.0, vx_mps=3.0, vy_mps=4.0, vz_mps=7.0)
    network = Network.from_settings(NETWORK)
    entry = json.loads(record(row, math.inf, "val", SEED, network))
    assert entry["key"] == "dji-mavic-3-000000-snrinf"
    assert (entry["label"], entry["category"], entry["snr_db"], entry["noise"]) == (
        0,
        "UAV",
        math.inf,
        False,
    )
    assert entry["motion"]["rate_hz"] == row["rate_hz"] and entry["motion"]["phase_0_rad"] == 0.0
    assert entry["seed"] == SEED
    seen = entry["geometry"]["A"]
    # Station A stands at (0, 0, 25): range 50 m, level, receding at 5 m/s.
    assert seen["range_m"] == 50 and seen["omega"] == 0
    assert seen["radial_mps"] == pytest.approx(5)
    assert seen["psi"] == pytest.approx(
        -math.sin(math.radians(30)) * 0.6 + math.cos(math.radians(30)) * 0.8
    )
    assert entry["versions"] == {"lowalt": DATA_VERSION}


def test_a_record_does_not_depend_on_the_version_of_the_package():
    made = """
import sys, lowalt
{}
sys.path[:0] = ["tests/support"]
from dataset import NETWORK, motion_rows
from lowalt.config.network import Network
from lowalt.shards.sample_record import record

print(record(motion_rows("seen")[0], 3.0, "val", 1, Network.from_settings(NETWORK)).decode())
"""
    here, later = printed([made.format("pass"), made.format("lowalt.__version__ = '9.9.9'")])
    assert here == later and f'"versions":{{"lowalt":"{DATA_VERSION}"}}' in here


def types(value):
    """The tree of a record's types, a leaf for each value."""
    return (
        {name: types(item) for name, item in value.items()}
        if isinstance(value, dict)
        else type(value)
    )


def test_every_field_has_one_type_in_all_records():
    network = Network.from_settings(NETWORK)
    rows = [*motion_rows("seen"), *motion_rows("unseen")]
    trees = [
        types(json.loads(record(row, snr, "val", SEED, network)))
        for row in rows
        for snr in (3, 3.5, math.inf)
    ]
    assert all(tree == trees[0] for tree in trees)
    assert type(None) not in trees[0]["motion"].values()


def test_a_record_tells_row_and_snr_back():
    row = motion_rows("seen")[0]
    for snr_db in (3.0, math.inf):
        text = record(row, snr_db, "val", SEED, Network.from_settings(NETWORK))
        again, snr = row_of(json.loads(text))
        assert snr == snr_db
        assert record(again, snr, "val", SEED, Network.from_settings(NETWORK)) == text


def test_geometry_above_a_station_is_finite():
    row = {**motion_rows("seen")[0], "x_m": 0.0, "y_m": 0.0, "z_m": 25.0}
    assert geometry(row, Network.from_settings(NETWORK))["A"] == {
        "range_m": 0.0,
        "psi": 0.0,
        "omega": 0.0,
        "radial_mps": 0.0,
    }


def test_a_link_sees_the_mean_range_and_speed_of_both_stations_and_its_receiver_s_direction():
    """From 40 m above and 30 m before a station, seen by another one 90 m further off at the same
    height.
    """
    seen = {
        "position_m": (0.0, 0.0, 0.0),
        "horizontal": (1.0, 0.0, 0.0),
        "transmitter": None,
        "name": "A",
    }
    sender = SimpleNamespace(**seen | {"position_m": (30.0, 0.0, -50.0)})
    receiver = SimpleNamespace(**seen | {"transmitter": sender})
    row = dict(x_m=30.0, y_m=0.0, z_m=40.0, vx_mps=0.0, vy_mps=0.0, vz_mps=5.0)
    found = geometry(row, SimpleNamespace(stations=[receiver]))["A"]
    assert found == pytest.approx(
        {"range_m": (50 + 90) / 2, "psi": 0.6, "omega": 0.8, "radial_mps": (4 + 5) / 2}
    )


def test_a_target_of_unknown_place_has_nulls_where_numbers_would_stand():
    row = {**motion_rows("seen")[0], "x_m": math.nan}
    entry = json.loads(record(row, 3, "val", SEED, Network.from_settings(NETWORK)))
    assert entry["motion"]["x_m"] is None and entry["motion"]["phase_0_rad"] is None
    assert set(entry["geometry"]["B"].values()) == {None}


def test_a_tar_header_holds_names_of_a_hundred_bytes_and_no_more():
    writer = Writer(io.BytesIO())
    writer.add("k" * 95, b"", "png", b"")
    for key, named in [("k" * 96, "100 bytes"), ("a/b", "no slash"), ("a.b", "no dot")]:
        with pytest.raises(InputError, match=named):
            writer.add(key, b"", "png", b"")


def test_keys_are_unique_and_without_dots():
    assert sample_key("EH216-S", 7, 3.5) == "eh216-s-000007-snr003p5"
    assert slug_of(sample_key("EH216-S", 1_234_567, -5.0)) == "eh216-s"
    snrs = [3, 3.5, -60, 200, 0.25, math.inf, 13, -3.5]
    keys = {sample_key("EH216-S", 7, snr) for snr in snrs}
    assert len(keys) == len(snrs)
    assert not any("." in key or "/" in key for key in keys)
    assert snr_label(3) == snr_label(3.0) == "snr003"


@pytest.mark.parametrize("samples", [0, 1, 2, 3])
def test_an_archive_ends_with_two_empty_blocks_at_a_whole_record(samples):
    """As plain tarfile fills it up, whatever it holds."""
    file = io.BytesIO()
    plain = io.BytesIO()
    writer = Writer(file)
    for number in range(samples):
        writer.add(f"k{number}", b"{}", "png", bytes(1000 * number))
    writer.close_with_checksum()
    with tarfile.open(fileobj=plain, mode="w") as archive:
        for number in range(2 * samples):
            info = tarfile.TarInfo(f"m{number}")
            info.size = 1000 * (number // 2) if number % 2 else 2
            archive.addfile(info, io.BytesIO(bytes(info.size)))
    assert len(file.getvalue()) == len(plain.getvalue())
