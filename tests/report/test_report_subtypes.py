"""The section on subtypes: the worst first, and its reasons from test samples of the last protocol
alone.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.config.classes import CATEGORIES
from lowalt.recognition.predictions import Predictions
from lowalt.report.sections import subtypes
from made_predictions import SUBTYPES, run_files


def test_reasons_are_those_of_test_samples_and_the_worst_subtype_stands_first(tmp_path):
    path, found, _ = run_files(tmp_path, "unseen", "ABC:VRP", 0.6)
    rows = [
        {
            "protocol": "seen",
            "scheme": "ABC:VRP",
            "subtype": name,
            "category": CATEGORIES[label],
            "accuracy_percent": str(20 + 7 * place),
        }
        for place, (name, (_, label)) in enumerate(SUBTYPES.items())
    ]
    rows += [
        {**row, "protocol": "unseen", "accuracy_percent": str(90 - float(row["accuracy_percent"]))}
        for row in rows
        if SUBTYPES[row["subtype"]][0] == "unseen"
    ]
    tables = {"subtypes": rows, "distances": []}
    methods = {
        "__contains__": lambda *_: True,
        "paths": lambda *_: [path],
        "table": lambda _, name, *__: tables[name],
    }
    inputs = type("Inputs", (), methods)()
    shards = SimpleNamespace(
        classes=CATEGORIES, keys=np.sort(found.key).astype("S"), record=lambda _: {"motion": {}}
    )
    shown = subtypes.values(SimpleNamespace(inputs=inputs, shards=shards))
    assert set(shown["reasons"]) == {
        name for name, (group, _) in SUBTYPES.items() if group == "unseen"
    }
    last = [float([*values.values()][-1]) for _, _, values in shown["rows"]]
    assert last == sorted(last)
    models = len({key.rpartition("-")[0] for key in found.key[found.subtype == "Owl"].tolist()})
    assert f"of {models} motion models are wrong" in shown["reasons"]["Owl"]


RISING = np.linspace(2.0, 24.0, 24)


@pytest.mark.parametrize(
    ("wrong", "behind", "count", "words"),
    [
        (RISING > 14.0, False, "11 of 24", ", most of them faster (median 19.2 against 7.74 m/s)"),
        (RISING < 10.0, False, "9 of 24", ", most of them slower (median 5.83 against 17.3 m/s)"),
        (
            RISING < 10.0,
            True,
            "9 of 24",
            ", most of them seen more from the front or rear "
            "(median 0 against 90° from nose or tail)",
        ),
        (np.arange(24) % 2 == 0, False, "12 of 24", ""),
        (RISING > 21.0, False, "4 of 24", ""),
        # With p = 0.045 speed alone would be named; among five traits chance often gives as much.
        (np.isin(np.arange(24), [4, 10, 13, 15, 18, 20, 22, 23]), False, "8 of 24", ""),
    ],
)
def test_motion_models_that_are_always_wrong_are_told_apart_by_what_differs_most(
    wrong, behind, count, words
):
    """Speeds rise from model to model; `behind`: they do not, and those that are wrong fly away;
    all else is alike.
    """
    model = np.repeat(np.arange(24), 2)
    columns = {
        "key": [f"crow-{number}-{snr}" for number in range(24) for snr in (3, 8)],
        "subtype": ["Crow"] * 48,
        "group": ["unseen"] * 48,
        "fold": ["test"] * 48,
        "model": model,
        "snr_db": np.tile([3.0, 8.0], 24),
        "label": np.ones(48, int),
        "range_m": np.full(48, 200.0),
        "aspect_deg": np.where(behind & wrong[model], 180.0, 90.0),
        "probabilities": np.eye(4)[np.where(wrong[model], 0, 1)],
    }
    found = Predictions(**{name: np.asarray(column) for name, column in columns.items()})
    motion = {"x_m": 200.0, "vx_mps": 0.0, "vy_mps": 0.0, "z_m": 60.0, "rate_hz": None}
    speeds = np.full(24, 9.0) if behind else RISING
    shards = SimpleNamespace(
        keys=found.key.astype("S"),
        record=lambda number: {"motion": motion | {"vz_mps": -speeds[number // 2]}},
    )
    sentence = subtypes.reasons(found, CATEGORIES, subtypes.traits_of(shards, found))["Crow"]
    assert (
        sentence
        == f"called UAV in 100% of its errors; {count} motion models are wrong at every SNR{words}"
    )
    assert subtypes.reasons(found.take(found.correct), CATEGORIES, {}) == {}


def test_traits_are_the_record_s_own_numbers_and_those_of_the_first_station():
    columns = {
        "key": ["crow-0", "car-7", "rec-0"],
        "subtype": ["Crow", "Car", "Rec"],
        "group": ["seen"] * 3,
        "fold": ["test"] * 3,
        "model": [0, 7, 0],
        "snr_db": [3.0] * 3,
        "label": [1, 2, 0],
        "range_m": [150.0, 80.0, np.nan],
        "aspect_deg": [150.0, 20.0, np.nan],
        "probabilities": np.eye(4)[[1, 2, 0]],
    }
    found = Predictions(**{name: np.asarray(column) for name, column in columns.items()})
    motion = {
        "x_m": 9.0,
        "vx_mps": 3.0,
        "vy_mps": -4.0,
        "vz_mps": 12.0,
        "z_m": 60.0,
        "rate_hz": 7.5,
    }
    records = [motion, motion | {"vz_mps": 0.0, "rate_hz": None}, {}]
    shards = SimpleNamespace(
        keys=found.key.astype("S"), record=lambda number: {"motion": records[number]}
    )
    traits = subtypes.traits_of(shards, found)
    wanted = {"Crow/0": (13.0, 150.0, 60.0, 7.5, 30.0), "Car/7": (5.0, 80.0, 60.0, 0.0, 20.0)}
    assert set(traits) == set(wanted)
    for name, values in wanted.items():
        assert list(traits[name]) == list(subtypes.TRAITS) and [
            *traits[name].values()
        ] == pytest.approx(values)
