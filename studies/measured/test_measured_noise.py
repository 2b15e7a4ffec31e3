"""Noise floors of raw recordings, and how often noise and targets are taken for a target."""

import numpy as np
import presence_rates
import pytest
from noise_floors import BANDS_HZ, NOISE, row
from presence_rates import noise_rows, target_rows
from recorded_sets import Measured

from lowalt.extensions.recordings.record import record
from lowalt.extensions.recordings.twin_receiver import shaped
from lowalt.extensions.recordings.twin_scenes import Library


@pytest.fixture(scope="module")
def library():
    return Library.read()


def raw(folder, values, rate):
    """A recording of one real channel as a set holds it."""
    np.save(folder / "noise.npy", values)
    block = {"file": "noise.npy", "carrier_hz": 24e9, "channel": "real", "rate_hz": rate, "label": "Vehicle",
             "source": "made here", "licence": "MIT"}  # fmt: skip
    return Measured("made", "tuning", record(block, folder, "here"), "vehicle_24ghz", "cw_24ghz")


@pytest.mark.parametrize("slow_db", [8.0, 25.0])
def test_slow_noise_is_found_at_its_level_over_white_noise_and_rises_as_one_over_f_squared(tmp_path, slow_db):
    rng, rate = np.random.default_rng(5), 12000.0
    count = int(16 * rate)
    white = np.sqrt(0.5) * rng.standard_normal(count)
    slow = 10 ** ((slow_db + 40) / 20) * shaped(count, rate, 1.0, rng).real
    found = dict(zip(NOISE, row(raw(tmp_path, white + slow, rate)), strict=True))
    assert found["windows"] == 40 and found["slow_db"] == pytest.approx(slow_db, abs=1.5)
    assert found["left_db"] < 1.5
    floors = [found[f"floor_{band:.0f}_db"] for band in BANDS_HZ]
    # From 10 to 20 Hz, far above white noise, the floor falls by 6 dB.
    assert floors[1] - floors[2] == pytest.approx(6.0, abs=2.0) and abs(floors[-1]) < 2.5


@pytest.mark.parametrize("name", ["uav_3ghz", "bird_drone_10ghz", "cw_24ghz"])
def test_white_noise_is_taken_for_a_target_in_no_window_of_the_table(library, name):
    white, receiver, *empty = noise_rows(name, library, 3)
    assert white[:3] == [name, "white", pytest.approx(np.nan, nan_ok=True)] and white[3:] == [3, 72, 0.0, 0.0, 0.0]
    assert receiver[1] == "receiver" and 0 <= receiver[6] <= receiver[5] <= receiver[7] <= 100
    # Where targets may hover, hum that is known from empty windows is no target.
    assert [row[1:6] for row in empty] == [["empty", pytest.approx(np.nan, nan_ok=True), 3, 57, 0.0]] * len(empty)
    assert len(empty) == (name != "cw_24ghz")


def test_strong_targets_are_found_and_weak_ones_are_not(library, monkeypatch):
    monkeypatch.setattr(presence_rates, "SNRS_DB", (-60.0, 30.0))
    monkeypatch.setattr(presence_rates, "CATEGORIES", ("Vehicle",))
    weak, strong = target_rows("cw_24ghz", library, 2)
    assert weak[1:6] == ["Vehicle", -60.0, 2, 12, 0.0] and strong[2:5] == [30.0, 2, 12] and strong[5] > 90
