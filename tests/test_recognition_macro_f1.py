"""Macro F1 by hand and as scikit-learn computes it, and the behaviour of its interval."""

import numpy as np
import pytest

from lowalt.numerics.streams import stream
from lowalt.recognition import schemes, tables
from lowalt.recognition.evaluated import Evaluated
from lowalt.recognition.macro_f1 import f1_by_snr, macro_f1
from lowalt.report.pivots import macro_f1 as in_words
from made_predictions import read_rows, run_files


def test_macro_f1_by_hand_counts_every_class_alike():
    # Class 0: 9 of 10 found, one of class 1 taken for it; class 1: one of two.
    counts = np.array([[9, 1], [1, 1]])
    assert macro_f1(counts) == pytest.approx((0.9 + 0.5) / 2)
    assert macro_f1(np.diag([5, 0, 3])) == 1.0
    # A class without samples that is guessed lowers the others' precision alone.
    assert macro_f1(np.array([[2, 2], [0, 0]])) == pytest.approx(2 * 2 / (2 * 2 + 0 + 2))


def test_macro_f1_is_scikit_learns():
    scores = pytest.importorskip("sklearn.metrics")
    rng = stream(1, "f1")
    labels, guesses = rng.integers(0, 4, 500), rng.integers(0, 4, 500)
    counts = np.zeros((4, 4))
    np.add.at(counts, (labels, guesses), 1)
    assert macro_f1(counts) == pytest.approx(scores.f1_score(labels, guesses, average="macro"), abs=1e-12)


def test_the_table_holds_macro_f1_within_its_interval_and_the_report_reads_it(tmp_path):
    paths = [run_files(tmp_path, "seen", "A:VT", share, seed)[0] for seed, share in ((0, 0.8), (1, 0.7))]
    runs = [Evaluated(path) for path in paths]
    tables.write(runs, schemes.names("config/schemes.csv"), {}, tmp_path / "out", seed=1)
    rows = read_rows(tmp_path / "out/accuracy.csv")
    for row in rows[:3]:
        wanted = []
        for run in runs:
            part = run.test.take(run.test.snr_db == float(row["snr_db"]))
            counts = np.zeros((4, 4))
            np.add.at(counts, (part.label, part.guesses), 1)
            wanted.append(100 * macro_f1(counts))
        assert float(row["macro_f1_percent"]) == pytest.approx(np.mean(wanted), abs=1e-4)
        assert float(row["macro_f1_low"]) < float(row["macro_f1_percent"]) < float(row["macro_f1_high"])
    mean = np.mean([float(row["macro_f1_percent"]) for row in rows[:3]])
    assert float(rows[3]["macro_f1_percent"]) == pytest.approx(mean, abs=1e-3)
    words = in_words(rows)["seen"]["A:VT"]
    assert words.startswith(f"{mean:.1f}"[:-1]) and " to " in words
    # A table of an earlier version has no macro F1; nothing is then said.
    assert in_words([{key: row[key] for key in ("protocol", "scheme", "snr_db")} for row in rows]) == {}


def test_whole_subtypes_give_the_wider_interval_where_subtypes_differ(tmp_path):
    found = Evaluated(run_files(tmp_path, "unseen", "A:VT", 0.9)[0]).test
    worst = found.subtype == "Owl"
    found.probabilities[worst] = np.roll(np.eye(4)[found.label[worst]], 1, axis=1)
    width = {}
    for whole in (False, True):
        interval = f1_by_snr([found], 4, whole, stream(1, "f1"))["avg"]
        width[whole] = interval.high - interval.low
    assert width[True] > 1.5 * width[False]
