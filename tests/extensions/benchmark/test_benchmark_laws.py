"""The benchmark's rules, each worked out a second time sample by sample."""

import hashlib

import numpy as np
import pytest

from lowalt.extensions.benchmark import baseline_table, benchmark_tracks, scoring
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, UNKNOWN
from lowalt.extensions.benchmark.definition import VERSION, named_seed, overlays, run_name
from lowalt.recognition.intervals import Interval


@pytest.mark.parametrize("shots", [1, 5, 20])
def test_few_shot_adds_the_first_motion_models_of_each_unseen_subtype_that_train(shots):
    facts = TRACKS["unseen"].truth("main").facts
    usual = set(TRACKS["unseen"].numbers("train").tolist())
    models = {}
    for number in range(len(facts)):
        if facts.group[number] == "unseen" and facts.fold[number] == "train":
            models.setdefault(facts.subtype[number], {}).setdefault(facts.model[number], []).append(
                number
            )
    added = set()
    for of_subtype in models.values():
        for model in sorted(of_subtype)[:shots]:
            added |= set(of_subtype[model])
    assert added and not added & usual
    assert set(TRACKS[f"few-shot-{shots}"].numbers("train").tolist()) == usual | added


def test_unseen_types_alone_are_tested_and_none_of_them_trains():
    facts = TRACKS["unseen"].truth("main").facts
    tested, trained = (facts.take(TRACKS["unseen"].numbers(use)) for use in ("test", "train"))
    assert set(tested.group) == {"unseen"} and set(tested.fold) == {"val", "test"}
    assert set(trained.group) == {"seen"} and set(trained.fold) == {"train"}


def test_nineteen_of_twenty_known_samples_are_accepted_where_the_held_out_ones_are_rejected():
    known = np.arange(100) / 1000
    held_out = np.array([0.0905, 0.0955, 0.2, 0.5])
    scores = np.concatenate([known, held_out])
    part = type(
        "Part",
        (),
        {"probabilities": np.stack([1 - scores, scores], 1), "label": np.repeat([0, 1], [100, 4])},
    )
    assert scoring.rejected_share(part, 1) == 0.75


def test_the_open_set_never_trains_on_its_held_out_class():
    track = TRACKS["open-set"]
    _, classes = track.truth("main")
    for use in ("train", "validation"):
        labels = track.samples(use).facts.label
        assert set(labels.tolist()) == set(range(len(classes))) - {classes.index(UNKNOWN)}
    assert classes.index(UNKNOWN) in track.samples("test").facts.label


def test_both_strata_of_the_open_set_weigh_the_same_whatever_their_numbers():
    track = TRACKS["open-set"]
    facts, classes = track.samples("test")
    weight, subtypes = scoring.models_of(track, facts, classes)
    bird = {
        name: label == classes.index(UNKNOWN)
        for name, label in zip(facts.subtype, facts.label, strict=True)
    }
    held_out = np.array([bird[name] for name in subtypes])
    assert weight[held_out].sum() == pytest.approx(len(facts) / 2)
    assert weight[~held_out].sum() == pytest.approx(len(facts) / 2)


def test_ranks_count_what_lies_below_and_half_of_what_is_equal():
    area, share = scoring.ranked(
        np.array([0.1, 0.4, 0.4, 0.9]), np.array([False, False, True, True])
    )
    assert area == pytest.approx((1.5 + 2) / 4)
    assert share == pytest.approx([1.0, 0.75, 0.75, 1.0])


def test_forty_labels_follow_the_plan_and_each_name_its_own():
    facts, names = TRACKS["forty"].truth()
    assert [names[label] for label in facts.label] == facts.subtype.tolist()
    assert list(names) == list(dict.fromkeys(facts.subtype.tolist()))


def test_tracks_have_the_stations_parts_shots_and_headlines_of_the_page():
    assert TRACKS["one-station"].stations == (0,) and TRACKS["one-station"].whole
    assert {name for name, track in TRACKS.items() if track.stations != (0, 1, 2)} == {
        "one-station"
    }
    assert {name: track.part for name, track in TRACKS.items() if track.part != "main"} == {
        "low-snr": "low-snr",
        "clutter": "clutter",
        "fr2": "fr2",
    }
    assert {name: track.shots for name, track in TRACKS.items() if track.shots} == {
        "few-shot-1": 1,
        "few-shot-5": 5,
        "few-shot-20": 20,
    }
    assert [name for name, track in TRACKS.items() if track.headline == "AUROC"] == ["open-set"]
    assert TRACKS["clutter"].trains_as == "seen" and TRACKS["forty"].trains_as == "forty"
    assert benchmark_tracks.USES == ("train", "validation", "test")


def test_seeds_and_names_of_parts_are_those_of_the_rules():
    # The part `clutter` keeps the seed of its first name.
    texts = {"main": VERSION, "clutter": f"{VERSION} town", "fr2": f"{VERSION} fr2"}
    for part, text in texts.items():
        assert named_seed(part) == int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")
    assert run_name("main") == "lowalt-40-v1" and run_name("clutter") == "lowalt-40-v1-clutter"
    assert overlays("main") == ["config/lowalt-40-v1.yaml"]
    assert overlays("fr2") == ["config/lowalt-40-v1.yaml", "config/lowalt-40-v1/fr2.yaml"]


def test_the_words_of_a_result_are_value_bounds_and_group():
    row = {"percent": "50", "low": "40", "high": "70", "group": "2", "confirmed_percent": ""}
    assert baseline_table.words(Interval(50.0, 40.0, 70.0)) == "50.0 (40.0 to 70.0)"
    assert baseline_table.result(row) == "50.0 (40.0 to 70.0) b"
    assert baseline_table.result(row | {"confirmed_percent": "51"}) == "50.0 (40.0 to 70.0) b ✓"
