"""The benchmark's definition and tracks.

They are frozen, disjoint, and from the data that the checksums describe.
"""

import hashlib
from pathlib import Path

import numpy as np
import pytest
import yaml

import model_files
from lowalt.commands.compare import leaves
from lowalt.config.layers import SCHEMA
from lowalt.extensions.benchmark import definition, frozen_bytes
from lowalt.extensions.benchmark.benchmark_tracks import INNER, TRACKS, UNKNOWN, held_out
from lowalt.extensions.benchmark.definition import MAIN, PARTS, VERSION, config_of, truth
from lowalt.files.errors import InputError
from lowalt.files.shipped import as_named
from lowalt.recognition import recogniser, runs, schemes
from lowalt.workflow.run import Run

ROOT = Path(__file__).parents[3]
MADE_OF = (
    "seed",
    "network",
    "targets",
    "motion",
    "echo",
    "effects",
    "noise",
    "spectra",
    "images",
    "split",
)
"""Blocks of a configuration that decide a byte of its samples."""


def test_root_seeds_are_those_of_the_names_of_the_parts():
    for part in PARTS:
        text = VERSION if part == MAIN else f"{VERSION} {'town' if part == 'clutter' else part}"
        assert config_of(part)["seed"] == int(hashlib.sha256(text.encode()).hexdigest()[:8], 16)


def test_the_definition_takes_nothing_that_decides_bytes_from_the_default():
    written = yaml.safe_load((ROOT / "config/lowalt-40-v1.yaml").read_text())
    merged = as_named(config_of(MAIN))
    for name in MADE_OF:
        given, own = (dict(leaves({name: block[name]})) for block in (merged, written))
        assert set(given) == set(own)
        assert {key: str(value) for key, value in given.items()} == {
            key: str(value) for key, value in own.items()
        }


@pytest.mark.parametrize("part", PARTS)
def test_samples_made_again_are_those_that_are_kept(part):
    """Every subtype, and a few samples of the smaller parts.

    A change of targets, motion, echo, noise or effects is seen here.
    """
    kept = [
        (name, digest)
        for name, digest in frozen_bytes.kept(frozen_bytes.SAMPLES).items()
        if name.startswith(part)
    ]
    assert len(kept) == frozen_bytes.FEW.get(part, 40)
    assert [(f"{part}/{key}", digest) for key, digest in frozen_bytes.samples(part)] == kept


def test_keys_and_folds_are_those_of_the_workflow():
    config = config_of(MAIN)
    run, (facts, classes) = Run.of(config, SCHEMA, None), truth(MAIN)
    assert len(facts) == run.plan.samples == 60000 == len(set(facts.key.tolist()))
    assert classes == tuple(run.classes)
    pairs = {f"{group}-{fold}" for group, fold in zip(facts.group, facts.fold, strict=True)}
    assert pairs == {name.rpartition("-")[0] for name in run.plan.shards}
    assert np.bincount(np.unique(facts.fold, return_inverse=True)[1]).tolist() == [
        6000,
        48000,
        6000,
    ]


@pytest.mark.parametrize("track", TRACKS.values(), ids=list(TRACKS))
def test_no_motion_model_is_in_two_parts_of_a_track(track):
    models = {}
    for use in ("train", "validation", "test"):
        part = track.part if use == "test" else MAIN
        facts = track.truth(part).facts.take(track.numbers(use))
        models[use] = {
            f"{part}/{name}/{model}" for name, model in zip(facts.subtype, facts.model, strict=True)
        }
        assert models[use]
        # All SNRs of a motion model are in one part.
        snrs = len(set(track.truth(part).facts.snr_db.tolist()))
        assert len(facts) == snrs * len(models[use])
    assert (
        not models["train"] & models["validation"]
        and not (models["train"] | models["validation"]) & models["test"]
    )


def test_the_unseen_subtypes_train_as_often_as_a_track_says():
    for name, shots in (
        ("unseen", 0),
        ("one-station", 0),
        ("few-shot-1", 1),
        ("few-shot-5", 5),
        ("few-shot-20", 20),
    ):
        facts = truth(MAIN).facts.take(TRACKS[name].numbers("train"))
        unseen = facts.take(facts.group == "unseen")
        models = {
            (subtype, model) for subtype, model in zip(unseen.subtype, unseen.model, strict=True)
        }
        assert len(models) == 20 * shots
        assert set(truth(MAIN).facts.take(TRACKS[name].numbers("test")).group.tolist()) == {
            "unseen"
        }


def test_the_held_out_class_neither_trains_nor_validates():
    facts, classes = TRACKS["open-set"].truth()
    held_out = facts.label == classes.index(UNKNOWN)
    assert not held_out[TRACKS["open-set"].numbers("train")].any()
    assert not held_out[TRACKS["open-set"].numbers("validation")].any()
    assert held_out[TRACKS["open-set"].numbers("test")].mean() == pytest.approx(0.25)


def test_forty_labels_are_the_subtypes():
    facts, classes = TRACKS["forty"].truth()
    assert [classes[label] for label in facts.label.tolist()] == facts.subtype.tolist()


@pytest.mark.parametrize("track", ["seen", "forty"])
def test_a_trained_network_may_have_the_classes_of_a_track(track, tmp_path):
    classes = TRACKS[track].truth().classes
    scheme = schemes.Scheme("A:VRP", (0,), (0,))
    block = {
        "backbone": "test_resnet",
        "weights": "none",
        "intra_depth": 1,
        "inter_depth": 1,
        "heads": 4,
        "feed_forward": 1,
        "dropout": 0.0,
        "hidden": 0,
    }
    weights = recogniser.Recogniser(
        scheme, block, 24, np.zeros((1, 256, 3), np.uint8), len(classes)
    ).state_dict()
    about = {"scheme": vars(scheme), "protocol": "seen", "network": block, "size": 24, "seed": 0}
    model_files.save(
        tmp_path / "model.safetensors",
        "{}",
        {"weights": weights, "colour_map": "gray", "classes": list(classes), **about},
    )
    assert runs.load(tmp_path / "model.safetensors").classes == classes


def test_the_inner_splits_hold_out_each_subtype_that_trains_once():
    track = TRACKS["unseen"]
    classes = track.truth().classes
    validated = []
    names = []
    for split in INNER:
        train = track.samples("train", split).facts
        validation = track.samples("validation", split).facts
        held = set(held_out(split))
        assert set(validation.subtype.tolist()) == held and not held & set(train.subtype.tolist())
        assert sorted(set(validation.label.tolist())) == list(range(len(classes)))
        assert len(train) == 24000 * 16 / 20 and set(train.group.tolist()) == {"seen"}
        validated += validation.key.tolist()
        names += sorted(held)
    assert sorted(validated) == sorted(track.samples("validation").facts.key.tolist())
    # Frozen with this version.
    digest = hashlib.sha256("\n".join(names).encode()).hexdigest()
    assert digest.startswith("27a0a248ec4821e0")
    for wrong in (
        ("seen", "train", "inner-1"),
        ("unseen", "test", "inner-1"),
        ("unseen", "train", "inner-6"),
    ):
        with pytest.raises(InputError, match=r"expected one of .'inner-1'"):
            TRACKS[wrong[0]].numbers(*wrong[1:])


@pytest.mark.parametrize("use", ["validation", "test"])
@pytest.mark.parametrize("track", TRACKS.values(), ids=list(TRACKS))
def test_neighbours_that_validate_or_test_have_no_class_in_common(track, use):
    """The order of the rows tells no classes.

    Whoever is told the most frequent class of each twentieth of the rows answers little better than
    chance.
    """
    labels = track.samples(use).facts.label
    right = [np.bincount(rows).max() for rows in np.array_split(labels, 20)]
    assert sum(right) / len(labels) < np.bincount(labels).max() / len(labels) + 0.06


def test_samples_that_train_stay_in_the_order_of_the_definition():
    numbers = TRACKS["unseen"].numbers("train")
    assert (np.diff(numbers) > 0).all()


def test_each_part_has_a_seed_of_its_own_and_tests_alone():
    assert len({config_of(part)["seed"] for part in PARTS}) == len(PARTS)
    assert {track.part for track in TRACKS.values()} == set(PARTS)
    assert definition.overlays(MAIN) == ["config/lowalt-40-v1.yaml"]
