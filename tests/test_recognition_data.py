"""Samples, order, augmentation, schemes, predictions, tables and frozen inputs: everything that needs no torch."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.recognition import freeze, order, orderings, predictions, protocols, samples, schemes, tables
from lowalt.recognition.__main__ import main
from lowalt.recognition.augment import KEYS, augment

SUBTYPES = {"Mini": ("seen", 0), "Avata": ("unseen", 0), "Crow": ("seen", 1), "Owl": ("unseen", 1),
            "M9": ("seen", 2), "A6": ("unseen", 2), "Walk": ("seen", 3), "Run": ("unseen", 3)}  # fmt: skip
SNRS = (3.0, 13.0, np.inf)
PUBLISHED = orderings.read_published("config/published_accuracy.csv")


def facts(models=10, snrs=SNRS):
    rows = [
        (f"{name}-{model}-{snr:g}", name, model, snr, group, ("val", "test", *["train"] * 8)[model % 10], label)
        for name, (group, label) in SUBTYPES.items() for model in range(models) for snr in snrs
    ]  # fmt: skip
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    rng = stream(1, "facts")
    shape = (len(rows), 3)
    return samples.Facts(*columns, range_m=rng.uniform(50, 500, shape), aspect_rad=rng.uniform(0, np.pi, shape))


def cache(path, found, size=16):
    views = stream(2, "views").integers(0, 256, (len(found), 9, size, size), dtype=np.uint8)
    samples.write(path, views, found)
    return views


def test_the_table_of_schemes_holds_every_row_of_the_paper():
    table = schemes.read("config/schemes.csv", "ABC")
    with Path("config/published_accuracy.csv").open(newline="") as file:
        published = {(row["protocol"], row["scheme"]) for row in csv.DictReader(file)}
    ours = {(protocol, entry.name) for entry in table.values() for protocol in entry.protocols}
    assert published <= ours
    assert table["ABC:VRP+TRP+VT"].columns == list(range(9))
    assert table["B:VRP+TRP+VT"].columns == [3, 4, 5]
    assert table["A:VT"].columns == [2]
    assert schemes.named("config/schemes.csv", "abc-vit-b-16-mean-fusion", "ABC").backbone == "vit_base_patch16_224"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("x,AD,VT,attention,,seen", "stations 'AD'"),
        ("x,A,VT+VT,attention,,seen", "spectra"),
        ("x,A,VT,sum,,seen", "fusion 'sum'"),
        ("x,A,VT,mean,,train", "protocols"),
        ("a:vt,A,VT,mean,,seen\nA:VT,A,VT,mean,,seen", "stands twice"),
    ],
)
def test_wrong_schemes_are_refused(tmp_path, line, words):
    path = tmp_path / "schemes.csv"
    path.write_text(",".join(schemes.COLUMNS) + "\n" + line + "\n")
    with pytest.raises(InputError, match=words):
        schemes.read(path, "ABC")


def test_a_row_may_bring_its_own_size_steps_and_share(tmp_path):
    path = tmp_path / "schemes.csv"
    head = ",".join((*schemes.COLUMNS, *schemes.OPTIONAL))
    path.write_text(f"{head}\nsmall,A,VT,mean,,seen,24,70,0.25\nplain,A,VT,mean,,seen,,,\n")
    small, plain = schemes.read(path, "ABC").values()
    block = {"size": 48, "training": {"steps": 100, "batch": 4}, "seed": 1}
    assert small.settled(block) == {"size": 24, "training": {"steps": 70, "batch": 4}, "seed": 1}
    assert plain.settled(block) == block
    assert (small.share, plain.share) == (0.25, 1.0)
    for column, value in (("size", "4"), ("steps", "0"), ("share", "1.5"), ("share", "half")):
        path.write_text(f"{','.join((*schemes.COLUMNS, column))}\nx,A,VT,mean,,seen,{value}\n")
        with pytest.raises(InputError, match=f"{column} '{value}'"):
            schemes.read(path, "ABC")


def test_a_share_takes_the_first_models_of_every_subtype_and_all_their_snrs():
    found = facts(models=10)
    for share, models in ((0.125, 1), (0.25, 2), (0.5, 5), (1.0, 10), (0.01, 1)):
        kept = found.take(samples.first_models(found, share))
        assert len(kept) == models * len(SUBTYPES) * len(SNRS)
        assert set(kept.model.tolist()) == set(range(models))
        assert set(kept.subtype.tolist()) == set(SUBTYPES)


def test_protocols_never_share_a_fold_between_their_parts():
    everything = {(group, fold) for group in ("seen", "unseen") for fold in ("train", "val", "test")}
    for protocol, parts in protocols.FOLDS.items():
        used = [pair for pairs in parts.values() for pair in pairs]
        assert len(used) == len(set(used)), protocol
        assert set(used) == everything
    assert {group for group, _ in protocols.folds("unseen", "test")} == {"unseen"}
    assert {group for part in ("train", "validation") for group, _ in protocols.folds("unseen", part)} == {"seen"}
    with pytest.raises(InputError, match="seen_test"):
        protocols.folds("seen", "seen_test")


def test_samples_in_memory_are_those_written_and_no_others(tmp_path):
    found = facts()
    halves = [np.arange(len(found)) % 2 == part for part in (0, 1)]
    views = [cache(tmp_path / f"{part}.npz", found.take(half)) for part, half in enumerate(halves)]
    pairs = {("seen", "train"), ("unseen", "val")}
    source = samples.ViewSamples([tmp_path / "1.npz", tmp_path / "0.npz"], [0, 5], pairs)
    kept = [np.array([pair in pairs for pair in zip(found.group[h], found.fold[h], strict=True)]) for h in halves]
    assert source.size == 16
    expected = np.concatenate([part[keep][:, [0, 5]] for part, keep in zip(views, kept, strict=True)])
    assert (source.views(np.arange(len(source.facts))) == expected).all()
    assert set(zip(source.facts.group.tolist(), source.facts.fold.tolist(), strict=True)) == pairs
    assert (source.views(np.array([3, 1])) == expected[[3, 1]]).all()


def test_damaged_or_foreign_views_are_refused_by_name(tmp_path):
    found = facts()
    cache(tmp_path / "good.npz", found)
    cache(tmp_path / "other.npz", found, size=8)
    (tmp_path / "cut.npz").write_bytes((tmp_path / "good.npz").read_bytes()[:5000])
    np.savez(tmp_path / "foreign.npz", views=np.zeros(3))
    everything = {("seen", "train")}
    for names, words in ((["cut.npz"], "cut.npz"), (["foreign.npz"], "foreign.npz"), (["none.npz"], "none.npz"),
                         (["good.npz", "other.npz"], "sizes")):  # fmt: skip
        with pytest.raises(InputError, match=words):
            samples.ViewSamples([tmp_path / name for name in names], [0], everything)
    with pytest.raises(InputError, match="none of the 1 files"):
        samples.ViewSamples([tmp_path / "good.npz"], [0], {("none", "train")})


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 3), st.integers(0, 50))
def test_an_epoch_visits_each_motion_model_as_often_as_asked(snrs, epoch):
    found = facts(models=7)
    drawn = order.epoch_order(found, 5, ("seen", "A"), epoch, snrs)
    motion = np.char.add(found.subtype, found.model.astype(str))
    assert len(set(drawn.tolist())) == len(drawn)
    _, counts = np.unique(motion[drawn], return_counts=True)
    assert len(counts) == 7 * len(SUBTYPES)
    assert (counts == (snrs or len(SNRS))).all()
    assert (drawn == order.epoch_order(found, 5, ("seen", "A"), epoch, snrs)).all()
    assert (drawn != order.epoch_order(found, 5, ("seen", "A"), epoch + 1, snrs)).any()


def test_every_snr_is_drawn_evenly_over_epochs():
    found = facts()
    drawn = np.concatenate([order.epoch_order(found, 5, (), epoch, 1) for epoch in range(60)])
    _, counts = np.unique(found.snr_db[drawn], return_counts=True)
    share = counts / counts.sum()
    assert np.abs(share - 1 / 3).max() < 4 * np.sqrt(2 / 9 / counts.sum())


def test_batches_are_full_and_in_order():
    parts = order.batches(np.arange(23), 5)
    assert [part.tolist() for part in parts] == [list(range(start, start + 5)) for start in (0, 5, 10, 15)]
    assert [part.tolist() for part in order.batches(np.arange(3), 5)] == [[0, 1, 2]]


def block(**changes):
    return {**dict.fromkeys(KEYS, 0.0), **changes}


def test_augmentation_without_strength_changes_nothing_and_never_its_input():
    images = stream(3, "images").integers(0, 256, (4, 9, 12, 12), dtype=np.uint8)
    before = images.copy()
    assert (augment(images, list(range(9)), block(), stream(1, "a")) == images).all()
    strong = block(
        mirror=0.5, shift_doppler=0.3, shift_time=0.3, contrast=1, mask_time=0.5, mask_doppler=0.5, drop_view=0.5
    )
    changed = augment(images, list(range(9)), strong, stream(1, "a"))
    assert (images == before).all()
    assert (changed == augment(images, list(range(9)), strong, stream(1, "a"))).all()
    assert (changed != images).any()


def test_all_views_of_a_sample_move_together_and_samples_apart():
    one = stream(4, "image").integers(0, 256, (1, 1, 16, 16), dtype=np.uint8)
    images = np.broadcast_to(one, (30, 9, 16, 16))
    moved = augment(images, list(range(9)), block(mirror=0.5, shift_doppler=0.4, shift_time=0.4), stream(2, "a"))
    assert (moved == moved[:, :1]).all()
    assert len(np.unique(moved[:, 0].reshape(30, -1), axis=0)) > 20


def test_mirror_turns_doppler_and_never_time():
    ramp = np.zeros((1, 2, 8, 8), np.uint8)
    ramp[..., 1, 2] = 200
    turned = augment(ramp, [0, 2], block(mirror=1.0), stream(1, "a"))
    assert (np.argwhere(turned[0] == 200)[:, 1:] == [6, 2]).all()


def test_contrast_keeps_zero_and_full_scale():
    images = np.stack([np.tile(np.arange(256, dtype=np.uint8), (256, 1))] * 3)[None]
    changed = augment(images, [0, 1, 2], block(contrast=1.0), stream(9, "a"))[0, :, 0].astype(int)
    assert changed[0, 0] == 0 and changed[0, 255] == 255
    assert changed[2, 128] == 128 and changed[2, 255] == 255
    assert (np.diff(changed[:, 1:], axis=1) >= 0).all()
    assert (changed[2, 129:] - 128 == 128 - changed[2, 127:0:-1]).all()


def test_masks_and_dropped_views_are_blank_at_the_zero_index():
    images = np.full((200, 3, 10, 10), 77, np.uint8)
    dropped = augment(images, [0, 1, 2], block(drop_view=0.5), stream(1, "a"))
    blank = (dropped == np.array([0, 0, 128])[:, None, None]).all((2, 3))
    assert 0.3 < blank.mean() < 0.6
    assert not blank.all(1).any()
    masked = augment(images, [0, 1, 2], block(mask_time=0.5), stream(1, "a"))
    columns = (masked[:, 0] == 0).all(1)
    assert (columns.sum(1) <= 5).all() and columns.any()
    assert ((masked[:, 2] == 128).all(1) == columns).all()


@pytest.mark.parametrize("change", [{"mirror": 1.5}, {"mask_time": "0.1"}, {"flip": 1}])
def test_wrong_augmentation_is_refused(change):
    from lowalt.recognition.augment import check

    with pytest.raises(InputError, match=next(iter(change))):
        check(block(**change))


def run_files(folder, protocol, scheme, accuracy, seed=0, models=40):
    """Predictions of a made-up scheme that is right with a known chance, the same luck for equal seeds."""
    found = facts(models)
    rng = stream(seed, "luck")
    right = rng.random(len(found)) < accuracy
    guess = np.where(right, found.label, (found.label + 1) % 4)
    probabilities = np.full((len(found), 4), 0.1)
    probabilities[np.arange(len(found)), guess] = 0.7
    path = folder / f"{schemes.slug(scheme)}-{protocol}-{seed}.csv"
    predictions.write(path, predictions.from_facts(found, (0, 2), probabilities))
    about = {"protocol": protocol, "scheme": scheme, "seed": seed, "hardware": "test bench", "train_s": 12.5}
    path.with_suffix(".json").write_text(json.dumps(about))
    return path, found, guess


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
    [("0.7", "1.7", "sum 1"), ("0.7", "x", "line"), ("p_bird", "bird", "columns"), ("Mini-1-3,", "Mini-0-3,", "twice")],
)
def test_malformed_predictions_are_refused_by_line(tmp_path, old, new, words):
    path, *_ = run_files(tmp_path, "seen", "A:VT", 0.8)
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=words):
        predictions.read(path)


def read_rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_tables_say_what_the_predictions_say(tmp_path):
    names = schemes.names("config/schemes.csv")
    path, found, guess = run_files(tmp_path, "seen", "ABC:VRP+TRP+VT", 0.95)
    weak, _, weak_guess = run_files(tmp_path, "seen", "A:VRP+TRP+VT", 0.6, seed=3)
    weak.with_suffix(".json").write_text(weak.with_suffix(".json").read_text().replace('"seed": 3', '"seed": 0'))
    unseen, *_ = run_files(tmp_path, "unseen", "A:VT", 0.7)
    tables.write([tables.Run(p) for p in (unseen, weak, path)], names, PUBLISHED, tmp_path / "out", seed=1)
    test = found.fold == "test"
    accuracy = read_rows(tmp_path / "out/accuracy.csv")
    assert [row["scheme"] for row in accuracy] == ["A:VRP+TRP+VT"] * 4 + ["ABC:VRP+TRP+VT"] * 4 + ["A:VT"] * 4
    head = ["protocol", "scheme", "snr_db", "accuracy_percent", "samples", "hardware", "seeds", "spread_points"]
    assert list(accuracy[0]) == head
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
        tables.write([tables.Run(path), tables.Run(path)], names, {}, tmp_path, 1)
    other, *_ = run_files(tmp_path, "seen", "D:VT", 0.9)
    with pytest.raises(InputError, match="D:VT"):
        tables.write([tables.Run(other)], names, {}, tmp_path, 1)


def test_several_seeds_are_averaged(tmp_path):
    names = schemes.names("config/schemes.csv")
    paths = [run_files(tmp_path, "seen", "A:VT", 0.9, seed=seed)[0] for seed in (0, 1, 2)]
    tables.write([tables.Run(path) for path in paths], names, {}, tmp_path, 1)
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
        tables.write([tables.Run(paths[seed])], names, {}, tmp_path / str(seed), 1)
        each += read_rows(tmp_path / str(seed) / "calibration.csv")
    assert float(calibrated["brier"]) == pytest.approx(np.mean([float(row["brier"]) for row in each]), abs=1e-5)
    assert len({row["brier"] for row in each}) > 1


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
    with pytest.raises(InputError, match=r"other\.csv: not a table"):
        orderings.read_published(tmp_path / "other.csv")


def test_frozen_inputs_are_held_to_their_checksums(tmp_path):
    (tmp_path / "clouds").mkdir()
    for name in ("clouds/b.npz", "clouds/a.npz", "motion.csv"):
        (tmp_path / name).write_text(name)
    sums = tmp_path / "SHA256SUMS"
    freeze.freeze([tmp_path / "motion.csv", tmp_path / "clouds/b.npz", tmp_path / "clouds/a.npz"], sums)
    assert freeze.verify(sums) == 3
    check = subprocess.run(["sha256sum", "--check", "--quiet", "SHA256SUMS"], cwd=tmp_path)
    assert check.returncode == 0
    (tmp_path / "clouds/a.npz").write_text("easier")
    with pytest.raises(InputError, match=r"clouds/a\.npz: has changed"):
        freeze.verify(sums)
    with pytest.raises(InputError, match="not below"):
        freeze.freeze([sys.executable], sums)


def test_commands_for_data_do_not_import_torch():
    names = ("__main__", "views", "tables", "freeze", "score", "samples", "augment", "order")
    lines = "; ".join(f"import lowalt.recognition.{name}" for name in names)
    code = f"{lines}; import sys; assert not any(name.split('.')[0] in ('torch', 'timm') for name in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
