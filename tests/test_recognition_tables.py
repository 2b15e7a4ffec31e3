"""Prediction files and the tables made of them: values by hand, malformed files refused, orderings by intervals."""

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.recognition import orderings, predictions, protocols, schemes, tables
from lowalt.recognition.__main__ import main
from lowalt.recognition.evaluated import Evaluated
from made_predictions import read_rows, run_files

PUBLISHED = orderings.read_published("config/published_accuracy.csv")


def test_predictions_survive_writing_and_align_by_key(tmp_path):
    path, found, guess = run_files(tmp_path, "seen", "A:VT", 0.8)
    back = predictions.read(path)
    assert (back.key == found.key).all() and (back.guesses == guess).all()
    assert (back.range_m == found.range_m[:, [0, 2]].min(1)).all()
    part = back.take(np.arange(len(back))[::-1]).of(protocols.folds("seen", "test"))
    assert part.key.tolist() == sorted(found.key[found.fold == "test"].tolist())
    twice = path.read_bytes()
    predictions.write(path, back)
    assert path.read_bytes() == twice


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [("0.7", "1.7", "sum 1"), ("0.7", "0.702", "sum 1"), ("0.7", "x", "line"), ("p_bird", "bird", "columns"),
     ("Mini-1-3,", "Mini-0-3,", "twice")],
)  # fmt: skip
def test_malformed_predictions_are_refused_by_line(tmp_path, old, new, words):
    path, *_ = run_files(tmp_path, "seen", "A:VT", 0.8)
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=words):
        predictions.read(path)


def test_tables_say_what_the_predictions_say(tmp_path):
    names = schemes.names("config/schemes.csv")
    path, found, guess = run_files(tmp_path, "seen", "ABC:VRP+TRP+VT", 0.95)
    weak, _, weak_guess = run_files(tmp_path, "seen", "A:VRP+TRP+VT", 0.6, seed=3)
    weak.with_suffix(".json").write_text(weak.with_suffix(".json").read_text().replace('"seed": 3', '"seed": 0'))
    unseen, *_ = run_files(tmp_path, "unseen", "A:VT", 0.7)
    tables.write([Evaluated(p) for p in (unseen, weak, path)], names, PUBLISHED, tmp_path / "out", seed=1)
    test = found.fold == "test"
    accuracy = read_rows(tmp_path / "out/accuracy.csv")
    assert [row["scheme"] for row in accuracy] == ["A:VRP+TRP+VT"] * 4 + ["ABC:VRP+TRP+VT"] * 4 + ["A:VT"] * 4
    head = ["protocol", "scheme", "snr_db", "accuracy_percent", *tables.F1, "samples", "hardware", "seeds"]
    assert list(accuracy[0]) == [*head, "spread_points"]
    assert (accuracy[0]["seeds"], accuracy[0]["spread_points"]) == ("1", "")
    for row in accuracy[4:7]:
        chosen = test & (found.snr_db == float(row["snr_db"]))
        assert float(row["accuracy_percent"]) == pytest.approx(100 * (guess == found.label)[chosen].mean(), abs=1e-4)
        assert int(row["samples"]) == chosen.sum()
    assert [row["snr_db"] for row in accuracy[4:8]] == ["3", "13", "inf", "avg"]
    mean = np.mean([float(row["accuracy_percent"]) for row in accuracy[4:7]])
    assert float(accuracy[7]["accuracy_percent"]) == pytest.approx(mean, abs=1e-3)
    assert {row["protocol"] for row in read_rows(tmp_path / "out/seen_test.csv")} == {"unseen"}
    counts = {(row["category"], row["predicted"]): int(row["samples"])
              for row in read_rows(tmp_path / "out/confusion.csv") if row["scheme"] == "ABC:VRP+TRP+VT"}  # fmt: skip
    assert counts["Bird", "Vehicle"] == (test & (found.label == 1) & (guess == 2)).sum()
    assert sum(counts.values()) == test.sum()
    compared = read_rows(tmp_path / "out/comparisons.csv")
    assert [(row["over"], row["resampled"], row["seeds"]) for row in compared] == [
        ("A:VRP+TRP+VT", "motion models", "1")
    ]
    gain = 100 * ((guess == found.label)[test].mean() - (weak_guess == found.label)[test].mean())
    for row in compared:
        assert float(row["difference_points"]) == pytest.approx(gain, abs=1e-3)
        assert float(row["low"]) < gain < float(row["high"])
        assert float(row["low"]) > 0
    (ordering,) = read_rows(tmp_path / "out/orderings.csv")
    assert (ordering["ordering"], ordering["over"]) == ("not ranked", "A:VRP+TRP+VT")
    assert float(ordering["paper_points"]) == pytest.approx(99.88 - 98.94)
    bands = [row for row in read_rows(tmp_path / "out/reliability.csv") if row["scheme"] == "ABC:VRP+TRP+VT"]
    assert sum(int(row["samples"]) for row in bands) == test.sum()
    right = sum(int(row["samples"]) * float(row["accuracy_percent"]) for row in bands) / test.sum()
    assert right == pytest.approx(100 * (guess == found.label)[test].mean(), abs=1e-3)
    alarms = read_rows(tmp_path / "out/alarms.csv")
    assert [float(row["asked_percent"]) for row in alarms[:3]] == [90, 95, 99]


def test_two_runs_of_one_seed_and_unknown_schemes_are_refused(tmp_path):
    names = schemes.names("config/schemes.csv")
    path, *_ = run_files(tmp_path, "seen", "A:VT", 0.9)
    with pytest.raises(InputError, match="two prediction files"):
        tables.write([Evaluated(path), Evaluated(path)], names, {}, tmp_path, 1)
    other, *_ = run_files(tmp_path, "seen", "D:VT", 0.9)
    with pytest.raises(InputError, match="D:VT"):
        tables.write([Evaluated(other)], names, {}, tmp_path, 1)


def test_several_seeds_are_averaged(tmp_path):
    names = schemes.names("config/schemes.csv")
    paths = [run_files(tmp_path, "seen", "A:VT", 0.9, seed=seed)[0] for seed in (0, 1, 2)]
    tables.write([Evaluated(path) for path in paths], names, {}, tmp_path, 1)
    trainings = read_rows(tmp_path / "seeds.csv")
    assert [(row["seed"], row["train_s"], row["hardware"]) for row in trainings[1:]] == [
        ("1", "12.5", "test bench"), ("2", "12.5", "test bench"),
    ]  # fmt: skip
    seeds = [float(row["accuracy_percent"]) for row in trainings]
    average = next(row for row in read_rows(tmp_path / "accuracy.csv") if row["snr_db"] == "avg")
    assert len(seeds) == 3 and len(set(seeds)) > 1
    assert float(average["accuracy_percent"]) == pytest.approx(np.mean(seeds), abs=1e-3)
    assert average["seeds"] == "3"
    assert float(average["spread_points"]) == pytest.approx(np.std(seeds, ddof=1), abs=1e-3)
    (calibrated,) = read_rows(tmp_path / "calibration.csv")
    each = []
    for seed in (0, 1, 2):
        tables.write([Evaluated(paths[seed])], names, {}, tmp_path / str(seed), 1)
        each += read_rows(tmp_path / str(seed) / "calibration.csv")
    assert float(calibrated["brier"]) == pytest.approx(np.mean([float(row["brier"]) for row in each]), abs=1e-5)
    assert len({row["brier"] for row in each}) > 1


def test_bands_begin_at_multiples_of_their_width_and_leave_out_samples_without_a_value(tmp_path):
    """Ranges in bands of 50 m, aspects in bands of 30 degrees; the means are over both seeds."""
    paths = [run_files(tmp_path, "seen", "A:VT", 0.7, seed=seed)[0] for seed in (0, 1)]
    runs = [Evaluated(path) for path in paths]
    test = runs[0].test
    values = np.where(np.arange(len(test)) % 7 == 0, np.nan, 49.9 + 0.1 * (np.arange(len(test)) % 5))
    right = np.mean([run.test.correct for run in runs], axis=0)
    rows = list(tables.band_rows(runs, lambda found: values, 50))
    for row, (start, chosen) in zip(rows, ((0, values < 50), (50, values >= 50)), strict=True):
        assert row == [f"{start}", f"{start + 50}", f"{100 * right[chosen].mean():.4f}", chosen.sum()]
    tables.write(runs, ["A:VT"], {}, tmp_path, 1)
    for name, column, width in (("ranges", test.range_m, 50), ("aspects", test.aspect_deg, 30)):
        found = read_rows(tmp_path / f"{name}.csv")
        firsts = sorted(set((column // width * width).astype(int).tolist()))
        assert [(row["from"], row["to"]) for row in found] == [(f"{one}", f"{one + width}") for one in firsts]
        assert sum(int(row["samples"]) for row in found) == len(test)


def test_tables_do_without_published_accuracies(tmp_path):
    paths = [run_files(tmp_path, "seen", scheme, 0.9)[0] for scheme in ("A:VRP+TRP+VT", "ABC:VRP+TRP+VT")]
    main(["tables", "--settings", '{"seed": 1}', "--predictions", *map(str, paths), "--out", str(tmp_path / "out")])
    (ordering,) = read_rows(tmp_path / "out/orderings.csv")
    assert ordering["paper_points"] == "" and ordering["difference_points"]


@pytest.mark.parametrize(
    ("low", "high", "ordering"),
    [("0.1", "2.0", "holds"), ("-2.0", "-0.1", "reversed"), ("-0.1", "0.1", "undecided"), ("0.0", "1.0", "undecided")],
)
def test_an_ordering_holds_only_where_its_interval_lies_above_zero(low, high, ordering):
    row = ["seen", "ABC:X", "A:X", "stations", "seeds, motion models"]
    published = {("seen", "ABC:X"): 99.0, ("seen", "A:X"): 97.5}
    for seeds, expected in ((3, ordering), (2, "not ranked")):
        assert list(orderings.ordering_rows([[*row, seeds, "1.0", low, high]], published)) == [
            ["seen", "ABC:X", "A:X", "stations", "1.50", seeds, "1.0", low, high, expected]
        ]
    assert next(orderings.ordering_rows([[*row, 3, "1.0", low, high]], {}))[4] == ""


def test_published_accuracies_are_read_as_averages_and_others_refused(tmp_path):
    assert PUBLISHED["seen", "ABC:VRP+TRP+VT"] == 99.88
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match=r"other\.csv: lacks the columns"):
        orderings.read_published(tmp_path / "other.csv")
