"""Models of other runs on this run's samples: paired differences exact by construction, leaks and strangers refused."""

import csv
import json

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recognition import predictions, samples, transfer
from lowalt.recognition.evaluated import Evaluated

SNRS = (3.0, np.inf)


def predicted(path, right, trained_on="", scheme="A:VT", seed=0):
    """Predictions for 40 motion models, at 3 dB and without noise, of which the `right` ones are called rightly."""
    count = len(right)
    label = np.arange(count // 2).repeat(2) % 4
    facts = samples.Facts(
        key=np.array([f"k{number:03d}" for number in range(count)]), subtype=np.char.add("s", label.astype(str)),
        model=np.arange(count // 2).repeat(2), snr_db=np.tile(SNRS, count // 2), group=np.full(count, "seen"),
        fold=np.full(count, "test"), label=label, range_m=np.ones((count, 3)), aspect_rad=np.ones((count, 3)),
    )  # fmt: skip
    guess = np.where(right, label, (label + 1) % 4)
    predictions.write(path, predictions.from_facts(facts, (0,), np.eye(4)[guess]))
    about = {"protocol": "seen", "scheme": scheme, "seed": seed, "hardware": "none", "trained_on": trained_on}
    path.with_suffix(".json").write_text(json.dumps(about))
    return Evaluated(path)


def table(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_differences_are_paired_and_every_snr_stands_apart(tmp_path):
    own = np.ones(80, dtype=bool)
    own[:8] = False
    other = own.copy()
    # The other model loses ten motion models at 3 dB and none without noise.
    other[20:40:2] = False
    runs = predicted(tmp_path / "own.csv", own), predicted(tmp_path / "other.csv", other, "elsewhere")
    transfer.write([runs[0]], [runs[1]], ["A:VT"], tmp_path / "transfer.csv", 1)
    rows = table(tmp_path / "transfer.csv")
    assert [row["snr_db"] for row in rows] == ["3", "inf", "avg"]
    assert {row["trained_on"] for row in rows} == {"elsewhere"}
    assert [float(row["own_percent"]) for row in rows] == [90.0, 90.0, 90.0]
    assert [float(row["difference_points"]) for row in rows] == [-25.0, 0.0, -12.5]
    assert [int(row["samples"]) for row in rows] == [40, 40, 80]
    low, high = float(rows[0]["low"]), float(rows[0]["high"])
    assert -45 < low < -25 < high < -10
    assert (float(rows[1]["low"]), float(rows[1]["high"])) == (0.0, 0.0)
    assert {(row["seeds"], row["spread_points"]) for row in rows} == {("1", "")}


def test_the_spread_between_seeds_is_that_of_both_models_pooled(tmp_path):
    shares = {"": (40, 44), "elsewhere": (60, 60)}
    runs = {
        name: [
            predicted(tmp_path / f"{name}{seed}.csv", np.arange(80) < right, name, seed=seed)
            for seed, right in enumerate(rights)
        ]
        for name, rights in shares.items()
    }
    transfer.write(runs[""], runs["elsewhere"], ["A:VT"], tmp_path / "transfer.csv", 1)
    average = table(tmp_path / "transfer.csv")[-1]
    assert (average["seeds"], float(average["difference_points"])) == ("2", 22.5)
    # 50 and 55 % of one model, 75 % twice of the other: variances 12.5 and 0.
    assert float(average["spread_points"]) == pytest.approx(2.5)


def test_a_model_compared_with_itself_differs_nowhere(tmp_path):
    right = stream(1, "right").random(80) < 0.7
    own = predicted(tmp_path / "own.csv", right)
    same = predicted(tmp_path / "same.csv", right, "twin")
    for row in transfer.comparison([own], [same], "twin", 1):
        assert row[3:6] == ["0.0000"] * 3


def test_strangers_are_refused_by_name(tmp_path):
    own = predicted(tmp_path / "own.csv", np.ones(80, dtype=bool))
    fewer = predicted(tmp_path / "fewer.csv", np.ones(60, dtype=bool), "small")
    with pytest.raises(InputError, match="A:VT of small was tested on other samples"):
        transfer.write([own], [fewer], ["A:VT"], tmp_path / "t.csv", 1)
    lost = predicted(tmp_path / "lost.csv", np.ones(80, dtype=bool), "far", scheme="B:VT")
    with pytest.raises(InputError, match="far has B:VT in the seen protocol, this run has not"):
        transfer.write([own], [lost], ["A:VT", "B:VT"], tmp_path / "t.csv", 1)


def test_a_split_that_would_leak_is_refused():
    own = {"run": "here", "seed": 1, "split": {"by": "motion", "train": 8, "val": 1, "test": 1}}
    transfer.check_folds(own, {**own, "run": "there"})
    transfer.check_folds(own, {"run": "there", "seed": 2, "split": {"by": "sample", "train": 7, "val": 2, "test": 1}})
    with pytest.raises(InputError, match="'there' has the same seed 1"):
        transfer.check_folds(own, {**own, "run": "there", "split": {**own["split"], "by": "sample"}})
