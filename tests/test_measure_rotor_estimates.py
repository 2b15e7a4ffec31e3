"""The table of blade passing frequencies: errors are distances to the motion table's truth, of rotorcraft alone."""

import csv
import math

import numpy as np
import pytest
import yaml

from lowalt.common.errors import InputError
from lowalt.common.yaml_files import load_yaml
from lowalt.measure import rotor_estimates
from lowalt.motion import COLUMNS, write_table
from lowalt.recognition.rotor_blades import Blades
from test_recognition_features import body, noisy, rotor


def test_right_and_wrong_estimates_are_counted_against_the_motion_table(tmp_path):
    config = load_yaml("config/default.yaml") | {"noise": {"snr_db": [3, float("inf")]}}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(config))
    (tmp_path / "noisy").mkdir()
    rows, signals = [], []
    # Two blades; the second model's table says another rate than its signals have.
    for model, (rate, told) in enumerate([(88.0, 88.0), (61.0, 70.0)]):
        for subtype, category in (("DJI Mini 2", "UAV"), ("Crow", "Bird")):
            row = dict.fromkeys(COLUMNS, math.nan) | {"subtype": subtype, "category": category, "group": "seen"}
            place = {"x_m": 250.0, "y_m": 144.0, "z_m": 30.0}
            rows.append(row | place | {"model": model, "rate_hz": told})
            look = [noisy(body(1.0) * (1 + np.exp(1j) * rotor(rate, 2, 5.0)), 20, seed) for seed in range(3)]
            signals.append([look] * 2)
    (tmp_path / "motion").mkdir()
    write_table(tmp_path / "motion/seen-00000.csv", rows)
    np.save(tmp_path / "noisy/seen-00000.npy", np.array(signals, np.complex64))
    rotor_estimates.main(["--run", str(tmp_path), "--out", str(tmp_path / "rotors.csv")])
    with (tmp_path / "rotors.csv").open() as file:
        found = list(csv.DictReader(file))
    assert [row["subtype"] for row in found] == ["DJI Mini 2"] * 2 and found[-1]["snr_db"] == "inf"
    assert {(row["blades"], row["models"], row["right_percent"]) for row in found} == {("2", "2", "50.0")}
    assert float(found[0]["median_error_hz"]) == pytest.approx(9.0, abs=0.2)
    assert {row["pursued_right_percent"] for row in found} == {"50.0"}
    # A guess anywhere from the lowest frequency searched to half the rate, in cycles of a look of 400 symbols.
    guesses = np.linspace(rotor_estimates.LEAST_CYCLES, 200, 100_001)
    chance = 100 * np.mean(abs(guesses - 100) < rotor_estimates.NEAR_CYCLES)
    assert {row["chance_percent"] for row in found} == {f"{chance:.1f}"}
    assert {len(reads) for reads in rotor_estimates.estimates(tmp_path, 1).values()} == {1}
    (tmp_path / "noisy/seen-00000.npy").unlink()
    with pytest.raises(InputError, match="no signals of craft with rotors"):
        rotor_estimates.estimates(tmp_path, 20)


def test_lengths_and_parities_are_counted_where_they_are_told():
    def read(length_m, bounds_m, odd):
        told = Blades(length_m, bounds_m, odd, 0.0, 90.0)
        return rotor_estimates.Read(0.1, 3.0, 8.0, told, 0.1)

    reads = [
        read(0.11, (0.09, 0.12), False), read(0.13, (0.12, 0.14), False), read(0.12, (0.08, 0.13), None),
        read(None, None, None),
    ]  # fmt: skip
    # Right passing frequencies, their median error and level, those of pursuit; then lengths and parities.
    assert rotor_estimates.summary(reads, 2, 1.0) == [
        "100.0", "0.100", "8.0", "0.0", "75.0", "20.0", "66.7", "50.0", "2"
    ]  # fmt: skip
    assert rotor_estimates.summary(reads[3:], 2, 1.0)[4:] == ["0.0", "", "", "0.0", "0"]


def test_a_level_craft_right_above_a_mast_shows_its_rotors_no_edge():
    sines = rotor_estimates.level_sines({"x_m": 3.0, "y_m": 4.0, "z_m": 37.0}, np.array([[0, 0, 25.0], [3, 4, 25.0]]))
    np.testing.assert_allclose(sines, [5 / 13, 0.0])
