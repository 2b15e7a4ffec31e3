"""Submissions, their scores and the groups of the table."""

import gzip
import sys
from pathlib import Path

import numpy as np
import pytest
from sklearn.metrics import f1_score, roc_auc_score

from lowalt.__main__ import main
from lowalt.extensions.benchmark import baselines, scoring
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, UNKNOWN
from lowalt.extensions.benchmark.submission import read
from lowalt.files.errors import InputError
from lowalt.recognition.predictions import probability_columns

sys.path.append(str(Path(__file__).parents[3] / "studies/benchmark"))
import kept_results

UNSEEN = TRACKS["unseen"]
OPEN = TRACKS["open-set"]


def answers(track, seed, skill=2.0):
    """Probabilities that are right rather often."""
    facts, classes = track.samples()
    logits = np.random.default_rng(seed).normal(size=(len(facts), len(classes)))
    logits[np.arange(len(facts)), facts.label] += skill
    shares = np.exp(logits)
    return shares / shares.sum(1, keepdims=True)


def submission(path, track, shares, extra=""):
    """Write a submission line by line."""
    facts, classes = track.samples()
    lines = [",".join(("key", *probability_columns(classes)))]
    lines += [
        ",".join((key, *map(repr, row)))
        for key, row in zip(facts.key.tolist(), shares.tolist(), strict=True)
    ]
    path.write_text("\n".join(lines) + "\n" + extra)
    return path


def test_a_submission_comes_back_in_the_order_of_the_samples(tmp_path):
    shares = answers(UNSEEN, 0)
    shares[7] = 0.251, 0.25, 0.25, 0.25  # three decimals may sum to 1.001
    path = submission(tmp_path / "a.csv", UNSEEN, shares)
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([head, *rows[::-1]]))
    assert np.allclose(read(path, UNSEEN), shares)


def last(shares):
    """A change of the last row: its key with other probabilities."""
    return lambda rows: [*rows[:-1], f"{rows[-1].split(',')[0]},{shares}"]


FAULTS = {
    "missing": (
        lambda rows: rows[:-2],
        "2 of the 6000 test samples of the track unseen are missing, the first is",
    ),
    "twice": (lambda rows: [*rows, rows[7]], "line 6002: key .* stands twice"),
    "unknown": (
        lambda rows: [*rows, "owl-000999-snr003,1,0,0,0"],
        "owl-000999-snr003' is no sample of the track",
    ),
    "nan": (last("0.5,nan,0.5,0"), "line 6001: p_bird is 'nan'"),
    "words": (last("0.5,half,0.5,0"), "p_bird is 'half', expected a number"),
    "negative": (last("1.5,-0.5,0,0"), "p_uav is '1.5'"),
    "sum": (last("0.5,0.4,0,0"), "sum to 0.9, expected 1"),
    "cells": (lambda rows: [*rows, "owl,1"], "2 cells, expected 5"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_submission_is_refused_in_one_sentence(tmp_path, fault):
    change, sentence = FAULTS[fault]
    path = submission(tmp_path / "a.csv", UNSEEN, answers(UNSEEN, 0))
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([head, *change(rows)]) + "\n")
    with pytest.raises(InputError, match=sentence) as caught:
        read(path, UNSEEN)
    assert len(str(caught.value)) <= 400 and "\n" not in str(caught.value)


def test_a_compressed_file_semicolons_and_a_column_twice_are_named(tmp_path):
    path = submission(tmp_path / "a.csv", UNSEEN, answers(UNSEEN, 0))
    text = path.read_text()
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(text.encode()))
    with pytest.raises(
        InputError, match=r"a\.csv\.gz: submission is compressed \(gzip\), expected plain text"
    ):
        read(tmp_path / "a.csv.gz", UNSEEN)
    path.write_text(text.replace(",", ";"))
    with pytest.raises(InputError, match="cells are separated by semicolons, expected commas"):
        read(path, UNSEEN)
    path.write_text(text.replace("p_bird", "p_uav", 1))
    with pytest.raises(InputError, match="column 'p_uav' stands twice"):
        read(path, UNSEEN)


def test_the_track_of_one_station_says_what_its_scores_cannot_show(capsys):
    assert main(["benchmark", "tracks"]) == 0
    (line,) = [
        line for line in capsys.readouterr().out.splitlines() if line.startswith("one-station")
    ]
    assert "cannot show whether other stations were used" in line


def test_samples_that_are_not_tested_may_stand_in_a_submission(tmp_path):
    facts, _ = UNSEEN.truth()
    other = facts.take(UNSEEN.numbers("train")).key[0]
    path = submission(tmp_path / "a.csv", UNSEEN, answers(UNSEEN, 0), f"{other},1,0,0,0\n")
    assert read(path, UNSEEN).shape == (6000, 4)


def test_headline_and_f1_are_those_of_the_definitions():
    shares, (facts, _) = answers(UNSEEN, 1), UNSEEN.samples()
    found = scoring.scores(UNSEEN, [shares], {})
    guesses = shares.argmax(1)
    assert found["percent"].value == pytest.approx(100 * np.mean(guesses == facts.label))
    assert found["percent"].low < found["percent"].value < found["percent"].high
    by_snr = [
        f1_score(facts.label[some], guesses[some], average="macro")
        for snr in set(facts.snr_db.tolist())
        for some in [facts.snr_db == snr]
    ]
    assert found["macro_f1_percent"].value == pytest.approx(100 * np.mean(by_snr))
    owls = facts.subtype == "Owl"
    assert found["by_subtype_percent"]["Owl"] == pytest.approx(
        100 * np.mean(guesses[owls] == facts.label[owls])
    )
    by_name = found["by_subtype_percent"]
    assert found["median_percent"] == pytest.approx(np.median(list(by_name.values())))
    others = [share for name, share in by_name.items() if name not in ("EH 216 S", "Sparrow")]
    assert len(others) == 18 and found["others_percent"] == pytest.approx(np.mean(others))
    assert list(found["by_snr_percent"]) == ["3", "8", "13", "18", "23", "inf"]


def test_the_interval_of_a_headline_number_ends_at_0_and_100():
    facts, classes = UNSEEN.samples()
    # All subtypes but two are right in every sample, so an interval that is symmetric passes 100
    # percent.
    wrong = np.isin(facts.subtype, ["EH 216 S", "Sparrow"])
    for right, end in ((~wrong, "high"), (wrong, "low")):
        shares = np.eye(len(classes))[
            np.where(right, facts.label, (facts.label + 1) % len(classes))
        ]
        parts = [scoring.tested(UNSEEN, facts, shares)]
        found = scoring.headline(UNSEEN, scoring.values_of(UNSEEN, parts, classes))
        assert getattr(found, end) == {"high": 100.0, "low": 0.0}[end]
        assert found.low < found.value < found.high


def test_auroc_is_the_area_under_the_curve_and_its_interval_covers_it():
    shares, (facts, classes) = answers(OPEN, 2, 1.0), OPEN.samples()
    held_out = facts.label == classes.index(UNKNOWN)
    found = scoring.scores(OPEN, [shares], {})
    area = 100 * roc_auc_score(held_out, shares[:, classes.index(UNKNOWN)])
    assert found["percent"].value == pytest.approx(area)
    # Samples are independent here, so Hanley and McNeil's standard error of AUROC holds (Radiology
    # 143, 1982).
    share = area / 100
    known = (~held_out).sum()
    other = held_out.sum()
    first = share / (2 - share)
    second = 2 * share**2 / (1 + share)
    spread = (
        share * (1 - share) + (other - 1) * (first - share**2) + (known - 1) * (second - share**2)
    )
    variance = spread / known / other
    width = found["percent"].high - found["percent"].low
    assert width == pytest.approx(2 * 1.96 * 100 * variance**0.5, rel=0.25)


def test_equal_scores_count_half():
    area, share = scoring.ranked(np.array([1.0, 1.0, 0.0]), np.array([True, False, False]))
    assert area == 0.75 and share.tolist() == [0.75, 0.5, 1.0]


@pytest.mark.parametrize("track", [UNSEEN, OPEN], ids=["accuracy", "AUROC"])
def test_what_is_kept_of_a_baseline_gives_its_difference_back(track, tmp_path, monkeypatch):
    facts, classes = track.samples()
    parts = [scoring.tested(track, facts, answers(track, seed)) for seed in (3, 4)]
    kept_results.write_values(
        track, {"some method": kept_results.packed(track, parts, classes)}, tmp_path
    )
    monkeypatch.setattr(baselines, "path_of", lambda track: tmp_path / f"{track.name}.npz")
    kept = baselines.kept(track)
    found = scoring.scores(track, [part.probabilities for part in parts], kept)
    assert found["differences"]["some method"].value == pytest.approx(0, abs=0.02)
    better = scoring.scores(track, [answers(track, 5, 4.0)], kept)
    assert better["differences"]["some method"].low > 0
    share = better["percent"].value - found["percent"].value
    assert better["differences"]["some method"].value == pytest.approx(share, abs=0.02)


def test_a_group_ends_where_a_difference_is_certain():
    subtypes = np.repeat([f"type {number}" for number in range(20)], 50)
    draw = np.random.default_rng(0).random((4, 1000))
    levels = {"best": 0.92, "near": 0.915, "worse": 0.7, "also worse": 0.69}
    values = {
        name: (draw[number] < level)[None].astype(float)
        for number, (name, level) in enumerate(levels.items())
    }
    found = kept_results.groups(UNSEEN, np.ones(1000), subtypes, values)
    assert found == {"best": 1, "near": 1, "worse": 2, "also worse": 2}
