"""The table of accuracy with and without range profiles, from made predictions."""

import csv
import json

import numpy as np
import pytest
import yaml

from lowalt.common.errors import InputError
from lowalt.measure import range_profiles
from lowalt.recognition import predictions
from lowalt.recognition.predictions import Predictions

CLASSES = ("UAV", "Bird", "Vehicle", "Pedestrian")
SCHEMES = ("ABC:VRP+TRP+VT", "ABC:VRP+TRP+VT+HRRP")
MODELS = 10


def made(right: np.ndarray, other: int) -> Predictions:
    """Ten motion models of one subtype of each class; where a sample is not right, the class `other` places on is."""
    label = np.repeat(np.arange(4), MODELS)
    shares = np.full((4 * MODELS, 4), 0.1)
    shares[np.arange(4 * MODELS), np.where(right, label, (label + other) % 4)] = 0.7
    model = np.tile(np.arange(MODELS), 4)
    names = np.array([f"subtype{one}" for one in label])
    key = np.array([f"{name}-{one:06d}-snr003" for name, one in zip(names, model, strict=True)])
    same = np.full(4 * MODELS, "unseen"), np.full(4 * MODELS, "test"), model, np.full(4 * MODELS, 3.0)
    return Predictions(key, names, *same, label, np.full(4 * MODELS, 100.0), np.zeros(4 * MODELS), shares)


@pytest.fixture
def folder(tmp_path):
    """A finished run of two schemes and two seeds: without profiles 30 and 50 % right, with them 90 and 90 %."""
    block = {"table": "config/range-profiles.csv", "schemes": [*SCHEMES], "protocols": ["unseen"], "seeds": [0, 1]}
    stations = {name: {"position_m": [0, 0, 25], "normal_deg": 0} for name in "ABC"}
    network = {"subcarriers": 1024, "subcarrier_spacing_hz": 480e3, "stations": stations}
    (tmp_path / "config.yaml").write_text(
        yaml.safe_dump({"run": "made", "seed": 1, "network": network, "recognition": block})
    )
    for slug, share in (("abc-vrp-trp-vt", (0.3, 0.5)), ("abc-vrp-trp-vt-hrrp", (0.9, 0.9))):
        for seed in (0, 1):
            path = tmp_path / "predictions/unseen" / slug / f"{seed}.csv"
            path.parent.mkdir(parents=True, exist_ok=True)
            right = np.tile(np.arange(MODELS) < 10 * share[seed], 4)
            predictions.write(path, made(right, 2))
            about = {"protocol": "unseen", "scheme": slug, "seed": seed, "hardware": "", "classes": CLASSES}
            path.with_suffix(".json").write_text(json.dumps(about))
    return tmp_path


def test_rows_hold_accuracies_by_seed_and_the_difference_to_the_first_scheme(folder):
    out = folder / "table.csv"
    range_profiles.main(["--run", str(folder), "--out", str(out)])
    with out.open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["task"], row["scheme"]) for row in rows] == [
        (task, scheme) for task in ("four classes", "UAV or bird") for scheme in SCHEMES
    ]
    plain, profile = rows[:2]
    assert plain["by_seed_percent"] == "30.00 50.00" and plain["accuracy_percent"] == "40.00" and not plain["over"]
    assert not plain["difference_points"] and profile["by_seed_percent"] == "90.00 90.00"
    assert float(profile["difference_points"]) == 50.0 and float(profile["low"]) < 50.0 < float(profile["high"])
    assert profile["over"] == SCHEMES[0] and profile["cell_m"] == "0.305" and profile["seeds"] == "2"
    # UAVs taken for vehicles are neither class here: of UAV and bird, which then are equally probable, UAV counts.
    assert [row["by_seed_percent"] for row in rows[2:]] == ["65.00 75.00", "95.00 95.00"]


def test_schemes_tested_on_different_samples_are_refused(folder):
    path = folder / "predictions/unseen/abc-vrp-trp-vt-hrrp/1.csv"
    found = made(np.ones(4 * MODELS, bool), 2)
    predictions.write(path, found.__class__(np.char.add("x", found.key), *tuple(vars(found).values())[1:]))
    with pytest.raises(InputError, match="tested on different samples"):
        range_profiles.rows_of(folder)


def test_unseen_subtypes_are_drawn_as_wholes(folder, monkeypatch):
    asked = []
    real = range_profiles.strict_difference
    monkeypatch.setattr(range_profiles, "strict_difference", lambda *given: asked.append(given[4]) or real(*given))
    range_profiles.rows_of(folder)
    assert asked == [True, True]
