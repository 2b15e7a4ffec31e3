"""Tables from prediction files: values by hand, orderings by intervals, and models of other runs
compared by sample.
"""

import json

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recognition import paper_claims, predictions, samples, schemes, tables, transfer
from lowalt.recognition.evaluated import Evaluated
from lowalt.recognition.statistics import f1_by_snr, macro_f1
from made_predictions import read_rows, run_files

SNRS = (3.0, np.inf)


def test_two_runs_of_one_seed_and_unknown_schemes_are_refused(tmp_path):
    names = schemes.names("config/schemes.csv")
    path, *_ = run_files(tmp_path, "seen", "A:VT", 0.9)
    with pytest.raises(InputError, match="two prediction files"):
        tables.write([Evaluated(path), Evaluated(path)], names, {}, tmp_path, 1)
    other, *_ = run_files(tmp_path, "seen", "D:VT", 0.9)
    with pytest.raises(InputError, match="D:VT"):
        tables.write([Evaluated(other)], names, {}, tmp_path, 1)


def test_bands_begin_at_multiples_of_their_width_and_leave_out_samples_without_a_value(tmp_path):
    """The means are over both seeds."""
    paths = [run_files(tmp_path, "seen", "A:VT", 0.7, seed=seed)[0] for seed in (0, 1)]
    runs = [Evaluated(path) for path in paths]
    test = runs[0].test
    values = np.where(
        np.arange(len(test)) % 7 == 0, np.nan, 49.9 + 0.1 * (np.arange(len(test)) % 5)
    )
    right = np.mean([run.test.correct for run in runs], axis=0)
    rows = list(tables.band_rows(runs, lambda found: values, 50))
    for row, (start, chosen) in zip(rows, ((0, values < 50), (50, values >= 50)), strict=True):
        assert row == [
            f"{start}",
            f"{start + 50}",
            f"{100 * right[chosen].mean():.4f}",
            chosen.sum(),
        ]


@pytest.mark.parametrize(
    ("low", "high", "ordering"),
    [
        ("0.1", "2.0", "holds"),
        ("-2.0", "-0.1", "reversed"),
        ("-0.1", "0.1", "undecided"),
        ("0.0", "1.0", "undecided"),
    ],
)
def test_an_ordering_holds_only_where_its_interval_lies_above_zero(low, high, ordering):
    row = ["seen", "ABC:X", "A:X", "stations", "seeds, motion models"]
    published = {("seen", "ABC:X"): 99.0, ("seen", "A:X"): 97.5}
    for seeds, expected in ((3, ordering), (2, "not ranked")):
        assert list(paper_claims.ordering_rows([[*row, seeds, "1.0", low, high]], published)) == [
            ["seen", "ABC:X", "A:X", "stations", "1.50", seeds, "1.0", low, high, expected]
        ]
    assert next(paper_claims.ordering_rows([[*row, 3, "1.0", low, high]], {}))[4] == ""


def test_macro_f1_by_hand_counts_every_class_alike():
    # Class 0: 9 of 10 found, one of class 1 taken for it; class 1: one of two.
    counts = np.array([[9, 1], [1, 1]])
    assert macro_f1(counts) == pytest.approx((0.9 + 0.5) / 2)
    assert macro_f1(np.diag([5, 0, 3])) == 1.0
    # A class without samples that is guessed lowers the others' precision alone.
    assert macro_f1(np.array([[2, 2], [0, 0]])) == pytest.approx(2 * 2 / (2 * 2 + 0 + 2))


def test_whole_subtypes_give_the_wider_interval_where_subtypes_differ(tmp_path):
    found = Evaluated(run_files(tmp_path, "unseen", "A:VT", 0.9)[0]).test
    worst = found.subtype == "Owl"
    found.probabilities[worst] = np.roll(np.eye(4)[found.label[worst]], 1, axis=1)
    width = {}
    for whole in (False, True):
        interval = f1_by_snr([found], 4, whole, stream(1, "f1"))["avg"]
        width[whole] = interval.high - interval.low
    assert width[True] > 1.5 * width[False]


def predicted(path, right, trained_on="", scheme="A:VT", seed=0):
    """Predictions for 40 motion models, at 3 dB and without noise, of which the `right` ones are
    called rightly.
    """
    count = len(right)
    label = np.arange(count // 2).repeat(2) % 4
    known = samples.Facts(
        key=np.array([f"k{number:03d}" for number in range(count)]),
        subtype=np.char.add("s", label.astype(str)),
        model=np.arange(count // 2).repeat(2),
        snr_db=np.tile(SNRS, count // 2),
        group=np.full(count, "seen"),
        fold=np.full(count, "test"),
        label=label,
        range_m=np.ones((count, 3)),
        aspect_rad=np.ones((count, 3)),
    )
    guess = np.where(right, label, (label + 1) % 4)
    predictions.write(path, predictions.from_facts(known, (0,), np.eye(4)[guess]))
    about = {
        "protocol": "seen",
        "scheme": scheme,
        "seed": seed,
        "hardware": "none",
        "trained_on": trained_on,
    }
    path.with_suffix(".json").write_text(json.dumps(about))
    return Evaluated(path)


def test_differences_are_paired_and_every_snr_stands_apart(tmp_path):
    own = np.ones(80, dtype=bool)
    own[:8] = False
    other = own.copy()
    # The other model loses ten motion models at 3 dB and none without noise.
    other[20:40:2] = False
    runs = (
        predicted(tmp_path / "own.csv", own),
        predicted(tmp_path / "other.csv", other, "elsewhere"),
    )
    transfer.write([runs[0]], [runs[1]], ["A:VT"], tmp_path / "transfer.csv", 1)
    rows = read_rows(tmp_path / "transfer.csv")
    assert [row["snr_db"] for row in rows] == ["3", "inf", "avg"]
    assert {row["trained_on"] for row in rows} == {"elsewhere"}
    assert [float(row["own_percent"]) for row in rows] == [90.0, 90.0, 90.0]
    assert [float(row["difference_points"]) for row in rows] == [-25.0, 0.0, -12.5]
    assert [int(row["samples"]) for row in rows] == [40, 40, 80]
    low = float(rows[0]["low"])
    high = float(rows[0]["high"])
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
    average = read_rows(tmp_path / "transfer.csv")[-1]
    assert (average["seeds"], float(average["difference_points"])) == ("2", 22.5)
    # 50 and 55 % of one model, 75 % twice of the other: variances 12.5 and 0.
    assert float(average["spread_points"]) == pytest.approx(2.5)


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
    transfer.check_folds(
        own, {"run": "there", "seed": 2, "split": {"by": "sample", "train": 7, "val": 2, "test": 1}}
    )
    with pytest.raises(InputError, match="'there' has the same seed 1"):
        transfer.check_folds(
            own, {**own, "run": "there", "split": {**own["split"], "by": "sample"}}
        )
