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
from test_recognition_features import body, noisy, rotor


def test_right_and_wrong_estimates_are_counted_against_the_motion_table(tmp_path):
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(load_yaml("config/default.yaml")))
    (tmp_path / "noisy").mkdir()
    rows, signals = [], []
    # Two blades; the second model's table says another rate than its signals have.
    for model, (rate, told) in enumerate([(88.0, 88.0), (61.0, 70.0)]):
        for subtype, category in (("DJI Mini 2", "UAV"), ("Crow", "Bird")):
            row = dict.fromkeys(COLUMNS, math.nan) | {"subtype": subtype, "category": category, "group": "seen"}
            rows.append(row | {"model": model, "rate_hz": told})
            look = [noisy(body(1.0) * (1 + np.exp(1j) * rotor(rate, 2, 5.0)), 20, seed) for seed in range(3)]
            signals.append([look] * 6)
    (tmp_path / "motion").mkdir()
    write_table(tmp_path / "motion/seen-00000.csv", rows)
    np.save(tmp_path / "noisy/seen-00000.npy", np.array(signals, np.complex64))
    rotor_estimates.main(["--run", str(tmp_path), "--out", str(tmp_path / "rotors.csv")])
    with (tmp_path / "rotors.csv").open() as file:
        found = list(csv.DictReader(file))
    assert [row["subtype"] for row in found] == ["DJI Mini 2"] * 6 and found[-1]["snr_db"] == "inf"
    assert {(row["blades"], row["models"], row["right_percent"]) for row in found} == {("2", "2", "50.0")}
    assert float(found[0]["median_error_hz"]) == pytest.approx(9.0, abs=0.2)
    (tmp_path / "noisy/seen-00000.npy").unlink()
    with pytest.raises(InputError, match="no signals of craft with rotors"):
        rotor_estimates.estimates(tmp_path, 20)
