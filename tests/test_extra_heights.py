"""Other runs' samples with measured heights, or as signals: whose heights they are, one law, and what is refused."""

import json

import numpy as np
import pytest

from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.recognition import checkpoint, extra, samples, schemes
from lowalt.recognition.__main__ import main
from lowalt.recognition.features import NAMES
from lowalt.recognition.inference import Machine
from lowalt.recognition.order import batches, epoch_order
from lowalt.recognition.reader import Reader
from lowalt.recognition.slow_time import SlowTimeSamples
from lowalt.recognition.tracked import Tracked
from trainings import SETTINGS, with_training

CUED = schemes.Scheme("AC:VRP height", (0, 2), (0,), cues="height")
PLAIN = schemes.Scheme("AC:VRP", (0, 2), (0,))
SIGNALS = schemes.Scheme("AC on signals", (0, 2), (), method="cnn")
FEATURES = schemes.Scheme("AC on features", (0, 2), (), "concatenation", method="svm")
TRAIN = {("seen", "train")}


def write(folder, models, seed, fold="train", part=0):
    """One shard of a run, four classes at two SNRs: keys follow from class, model and SNR, all else from the seed."""
    rng = stream(seed, "extra heights", part, fold)
    rows = [
        (f"s{label}-{model:06d}-snr{snr:03d}", f"s{label}", model, float(snr), "seen", fold, label)
        for label in range(4) for model in models for snr in (3, 13)
    ]  # fmt: skip
    rows = [rows[number] for number in rng.permutation(len(rows))]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    count, name = len(rows), f"seen-{fold}-{part:05d}.npz"
    facts = samples.Facts(*columns, rng.uniform(100, 900, (count, 3)), np.zeros((count, 3)))
    for kind in ("views", "tracks", "slow_time"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    samples.write(folder / "views" / name, rng.integers(0, 256, (count, 9, 16, 16)).astype(np.uint8), facts)
    heights = rng.uniform(0, 150, (count, 3))
    np.savez(folder / "tracks" / name, key=facts.key, height_m=heights, range_m=facts.range_m)
    known = {key: getattr(facts, key) for key in samples.FACTS}
    signals = (rng.standard_normal((count, 3, 8)) + 1j * rng.standard_normal((count, 3, 8))).astype(np.complex64)
    features = rng.standard_normal((count, 3, len(NAMES))).astype(np.float32)
    np.savez(folder / "slow_time" / name, signals=signals, features=features, **known)
    return folder


def paths(folders, kind):
    return [str(path) for folder in folders for path in sorted((folder / kind).glob("*-train-*.npz"))]


def source(folders, scheme):
    """The training samples of files that are read as one run."""
    if scheme.sees != "images":
        return SlowTimeSamples(paths(folders, "slow_time"), scheme.sees, scheme.columns, TRAIN)
    images = samples.ViewSamples(paths(folders, "views"), scheme.columns, TRAIN)
    return Tracked(images, paths(folders, "tracks"), scheme.stations) if scheme.cues else images


def joined(folders, scheme):
    """The training samples of the first folder as the run's own, and of the others as other runs'."""
    own, *others = folders
    caches = paths(others, "views" if scheme.sees == "images" else "slow_time")
    heights = paths(others, "tracks") if scheme.cues else None
    return extra.joined(source([own], scheme), caches, heights, scheme, TRAIN)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two runs of two shards each, whose samples have the same keys, and the first one's validation samples."""
    folder = tmp_path_factory.mktemp("runs")
    for seed, name in enumerate(("own", "more")):
        write(folder / name, range(3), seed)
        write(folder / name, range(3, 5), seed, part=1)
    write(folder / "own", range(5, 7), 0, "val")
    return folder


def test_heights_follow_their_own_run_s_images_where_two_runs_have_samples_of_the_same_key(runs):
    own, more = (source([runs / name], CUED) for name in ("own", "more"))
    both = joined([runs / "own", runs / "more"], CUED)
    assert sorted(own.facts.key) == sorted(more.facts.key) and len(both.facts) == 80
    np.testing.assert_array_equal(both.height_m, np.concatenate([own.height_m, more.height_m]))
    np.testing.assert_array_equal(both.views(np.arange(80)), np.concatenate([own.source.images, more.source.images]))
    assert both.facts.key.tolist() == [*own.facts.key.tolist(), *more.facts.key.tolist()]
    assert len(np.unique(both.facts.model)) == 10 and len(own.facts) == len(own.height_m) == 40
    told = {}
    for path in paths([runs / "more"], "tracks"):
        with np.load(path) as data:
            chosen = data["height_m"][:, [0, 2]].astype(np.float32)
            told |= dict(zip(data["key"].tolist(), chosen.tolist(), strict=True))
    assert both.height_m[40:].tolist() == [told[key] for key in both.facts.key[40:].tolist()]


@pytest.mark.parametrize("scheme", [CUED, PLAIN, SIGNALS, FEATURES], ids=lambda scheme: scheme.name)
def test_samples_of_one_run_split_over_three_runs_give_the_same_batches(tmp_path, scheme):
    """Law: how samples are divided among runs changes no batch, as long as no motion model is divided."""
    folders = [write(tmp_path / name, range(start, start + 2), start) for start, name in ((0, "a"), (2, "b"), (4, "c"))]
    whole, split = source(folders, scheme), joined(folders, scheme)
    machine = Machine.here("fp32")
    got = []
    for found in (whole, split):
        order = epoch_order(found.facts, 3, ("seen",), 0, 1)
        reader = Reader(found, scheme.columns, SETTINGS["augmentation"], (3, "seen"), machine)
        if scheme.sees == "features":
            got.append([(found.views(order), found.facts.label[order])])
        else:
            got.append([reader[item] for item in enumerate(batches(order, 4))])
    assert len(got[0]) == len(got[1]) == (1 if scheme.sees == "features" else 6)
    for (one, labels), (other, their_labels) in zip(*got, strict=True):
        np.testing.assert_array_equal(labels, their_labels)
        pairs = zip(one, other, strict=True) if scheme.cues else [(one, other)]
        for first, second in pairs:
            np.testing.assert_array_equal(first, second)


def test_identity_holds_each_height_of_another_run(runs, tmp_path):
    write(tmp_path / "more", range(3), 1)
    before = joined([runs / "own", tmp_path / "more"], CUED).sha256()
    path = tmp_path / "more/tracks/seen-train-00000.npz"
    with np.load(path) as data:
        kept = dict(data)
    kept["height_m"][-1, 2] += 0.1
    np.savez(path, **kept)
    assert joined([runs / "own", tmp_path / "more"], CUED).sha256() != before
    # Station B is not among the scheme's.
    kept["height_m"][-1, 2] -= 0.1
    kept["height_m"][:, 1] += 1
    np.savez(path, **kept)
    assert joined([runs / "own", tmp_path / "more"], CUED).sha256() == before


FAULTS = {
    "lacking": r"no .*/more/tracks/seen-train-00001.npz, expected the heights of .*/more/views/seen-train-00001.npz",
    "surplus": r"--extra-tracks: .*/more/tracks/seen-train-00002.npz, expected no heights without a file of --extra",
    "turned": r"more/tracks/seen-train-00000.npz: other samples than .*more/views/seen-train-00000.npz",
    "stale": r"more/tracks/seen-train-00000.npz: sample 's.*' at ranges of .* make `tracks` of their run again",
    "damaged": r"more/tracks/seen-train-00000.npz: not a tracks file",
    "of the run itself": r"files in 2 folders, expected 1 as of --extra",
    "none": r"--extra-tracks: scheme 'AC:VRP height' has the cue 'height'",
    "uncalled for": r"--extra-tracks: scheme 'AC:VRP' has no cue",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_heights_that_are_not_those_of_the_other_run_s_samples_are_refused_by_file(runs, tmp_path, fault):
    folder, scheme = tmp_path / "more", CUED
    write(folder, range(3), 1)
    write(folder, range(3, 5), 1, part=1)
    heights = paths([folder], "tracks")
    with np.load(heights[0]) as data:
        kept = dict(data)
    if fault == "lacking":
        heights = heights[:1]
    elif fault == "surplus":
        heights.append(heights[1].replace("00001", "00002"))
    elif fault == "turned":
        np.savez(heights[0], **{key: values[::-1] for key, values in kept.items()})
    elif fault == "stale":
        np.savez(heights[0], **{**kept, "range_m": kept["range_m"] + 0.5})
    elif fault == "damaged":
        (folder / "tracks/seen-train-00000.npz").write_bytes(b"PK")
    elif fault == "of the run itself":
        heights += paths([runs / "own"], "tracks")
    else:
        heights, scheme = (None, CUED) if fault == "none" else (heights, PLAIN)
    own = source([runs / "own"], scheme)
    with pytest.raises(InputError, match=FAULTS[fault]):
        extra.joined(own, paths([folder], "views"), heights, scheme, TRAIN)


def test_samples_of_another_kind_length_or_number_of_stations_are_refused(runs, tmp_path):
    own = source([runs / "own"], SIGNALS)
    with pytest.raises(InputError, match="--extra: expected --views or --signals as well"):
        extra.with_extra(own, source([runs / "own"], PLAIN))
    path = write(tmp_path / "more", range(2), 1) / "slow_time/seen-train-00000.npz"
    with np.load(path) as data:
        kept = dict(data)
    np.savez(path, **{**kept, "signals": kept["signals"][:, :, :4]})
    with pytest.raises(InputError, match="samples: sizes 8 and 4, expected one size"):
        extra.joined(own, [str(path)], None, SIGNALS, TRAIN)
    np.savez(path, **{**kept, **{key: np.repeat(kept[key], 2, axis=1) for key in ("signals", "range_m", "aspect_rad")}})
    with pytest.raises(InputError, match="--extra: samples of 6 stations, expected 3 as the run's own"):
        extra.joined(own, [str(path)], None, SIGNALS, TRAIN)


def test_own_heights_of_two_runs_at_once_are_refused(runs):
    images = samples.ViewSamples(paths([runs / "own"], "views"), CUED.columns, TRAIN)
    with pytest.raises(InputError, match=r"more/tracks/.*npz: sample 's0-0.*' stands in .*own/tracks/.*npz too"):
        Tracked(images, paths([runs / "own", runs / "more"], "tracks"), (0, 2))


def test_the_command_trains_on_other_runs_heights_and_validates_on_its_own_alone(runs, tmp_path):
    (tmp_path / "schemes.csv").write_text(
        ",".join((*schemes.COLUMNS, "cues")) + "\nAC:VRP height,AC,VRP,attention,,seen,height\n"
    )
    settings = with_training(steps=2, validate_every=2) | {"size": 16}
    own = [str(path) for path in sorted((runs / "own/views").iterdir())]
    line = ["train", "--settings", json.dumps(settings), "--views", *own, "--tracks",
            *(path.replace("/views/", "/tracks/") for path in own), "--extra", *paths([runs / "more"], "views"),
            "--schemes", str(tmp_path / "schemes.csv"), "--stations", *"ABC", "--protocol", "seen",
            "--scheme", "AC:VRP height"]  # fmt: skip
    main([*line, "--extra-tracks", *paths([runs / "more"], "tracks"), "--out", str(tmp_path / "model")])
    assert json.loads((tmp_path / "model/run.json").read_text())["train_samples"] == 80
    kept = json.loads(checkpoint.load(tmp_path / "model/model.pt")[0])["samples"]
    assert kept["train"] == joined([runs / "own", runs / "more"], CUED).sha256()
    images = samples.ViewSamples(own, CUED.columns, {("seen", "val")})
    assert kept["validation"] == Tracked(images, [path.replace("/views/", "/tracks/") for path in own], (0, 2)).sha256()
    with pytest.raises(InputError, match="--extra-tracks: scheme 'AC:VRP height' has the cue 'height'"):
        main([*line, "--out", str(tmp_path / "none")])
