"""Samples, order, schemes, protocols and frozen inputs: data for recognition, which need no torch."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recognition import batches, freeze, protocols, samples, schemes
from lowalt.spectra import NAMES
from made_predictions import SNRS, SUBTYPES, facts

ROW = {
    "scheme": "x",
    "stations": "A",
    "spectra": "VT",
    "fusion": "attention",
    "backbone": "",
    "protocols": "seen",
}


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
    assert table["ABC:VRP+TRP+VT"].columns == [
        station * len(NAMES) + image for station in range(3) for image in range(3)
    ]
    assert table["B:VRP+TRP+VT"].columns == [len(NAMES) + image for image in range(3)]
    assert table["A:VT"].columns == [2]
    assert (
        schemes.named("config/schemes.csv", "abc-vit-b-16-mean-fusion", "ABC").backbone
        == "vit_base_patch16_224"
    )


def made(**changes):
    return schemes.scheme({**ROW, **changes}, "table line 2", "ABC")


@pytest.mark.parametrize(
    ("column", "good", "bad"),
    [
        ("stations", (), ("AD", "AA", "")),
        ("spectra", (), ("VT+VT", "XT")),
        ("fusion", ("mean",), ("sum",)),
        ("protocols", (), ("train",)),
        ("size", ("8", "1024"), ("7", "1025", "8.5", "x")),
        ("steps", ("1", "1000000000"), ("0", "1000000001", "1.5")),
        ("share", ("0.000001", "1"), ("0.0000009", "1.0000001", "-1", "nan")),
    ],
)
def test_cells_of_a_row_are_taken_up_to_both_ends_of_their_range_and_others_refused(
    column, good, bad
):
    for text in good:
        assert str(getattr(made(**{column: text}), column)) in (
            text,
            str(float(text) if column == "share" else text),
        )
    for text in bad:
        with pytest.raises(
            InputError, match=rf"table line 2: {column} '{re.escape(text)}', expected"
        ):
            made(**{column: text})


def test_a_row_may_bring_its_own_size_steps_and_share_and_stands_once(tmp_path):
    path = tmp_path / "schemes.csv"
    head = ",".join((*schemes.COLUMNS, *schemes.OPTIONAL))
    path.write_text(f"{head}\nsmall,A,VT,mean,,seen,24,70,0.25\nplain,A,VT,mean,,seen,,,\n")
    small, plain = schemes.read(path, "ABC").values()
    block = {"size": 48, "training": {"steps": 100, "batch": 4}, "seed": 1}
    assert small.settled(block) == {"size": 24, "training": {"steps": 70, "batch": 4}, "seed": 1}
    assert plain.settled(block) == block and (small.share, plain.share) == (0.25, 1.0)
    path.write_text(f"{head}\na:vt,A,VT,mean,,seen,,,\nA:VT,A,VT,mean,,seen,,,\n")
    with pytest.raises(InputError, match="line 3: scheme 'A:VT' stands twice"):
        schemes.read(path, "ABC")


def test_views_are_numbered_over_all_spectra_and_found_among_those_a_data_set_has():
    """The catalogue begins with VRP, TRP and VT; the data set's tiles hold VT before VRP, and no
    TRP.
    """
    count = len(schemes.SPECTRA)
    scheme = schemes.Scheme("x", (0, 2), (0, 2))
    assert scheme.columns == [0, 2, 2 * count, 2 * count + 2]
    assert schemes.columns_in(scheme.columns, ["vt", "vrp"], 3, "here") == [1, 0, 5, 4]
    with pytest.raises(InputError, match="here: 2 stations, the scheme needs 3"):
        schemes.columns_in(scheme.columns, ["vt", "vrp"], 2, "here")
    with pytest.raises(
        InputError, match=r"here: spectra \['vt'\], the scheme also needs \['vrp'\]"
    ):
        schemes.columns_in(scheme.columns, ["vt"], 3, "here")


def test_stations_of_one_letter_stand_together_and_others_are_joined():
    assert made().stations == (0,)
    assert schemes.scheme({**ROW, "stations": "CA"}, "", "ABC").stations == (0, 2)
    names = ["north", "south", "W"]
    assert schemes.scheme({**ROW, "stations": "W+north"}, "", names).stations == (0, 2)
    assert schemes.joined(["A", "B"]) == "AB" and schemes.joined(["A", "west"]) == "A+west"


def test_a_record_is_the_scheme_and_survives_json():
    plain = schemes.Scheme("x", (0,), (1, 2), size=24)
    assert (
        schemes.of_record(plain.record)
        == schemes.of_record(json.loads(json.dumps(plain.record)))
        == plain
    )


def test_a_share_takes_the_first_models_of_every_subtype_and_all_their_snrs():
    found = facts(models=10)
    for share, models in ((0.125, 1), (0.25, 2), (0.5, 5), (1.0, 10), (0.01, 1)):
        kept = found.take(samples.first_models(found, share))
        assert len(kept) == models * len(SUBTYPES) * len(SNRS)
        assert set(kept.model.tolist()) == set(range(models))
        assert set(kept.subtype.tolist()) == set(SUBTYPES)


def test_protocols_never_share_a_fold_between_their_parts():
    everything = {
        (group, fold) for group in ("seen", "unseen") for fold in ("train", "val", "test")
    }
    for protocol, parts in protocols.FOLDS.items():
        used = [pair for pairs in parts.values() for pair in pairs]
        assert len(used) == len(set(used)), protocol
        assert set(used) == everything
    assert {group for group, _ in protocols.folds("unseen", "test")} == {"unseen"}
    assert {
        group for part in ("train", "validation") for group, _ in protocols.folds("unseen", part)
    } == {"seen"}
    for protocol, parts in protocols.FOLDS.items():
        assert protocols.evaluated_folds(protocol) == everything - parts["train"]
    with pytest.raises(InputError, match="seen_test"):
        protocols.folds("seen", "seen_test")
    with pytest.raises(InputError, match="protocol 'own'"):
        protocols.evaluated_folds("own")


def test_samples_in_memory_are_those_written_and_no_others(tmp_path):
    found = facts()
    halves = [np.arange(len(found)) % 2 == part for part in (0, 1)]
    views = [cache(tmp_path / f"{part}.npz", found.take(half)) for part, half in enumerate(halves)]
    pairs = {("seen", "train"), ("unseen", "val")}
    source = samples.ViewSamples(
        [tmp_path / "1.npz", tmp_path / "0.npz"], [0, len(NAMES) + 2], pairs
    )
    kept = [
        np.array([pair in pairs for pair in zip(found.group[h], found.fold[h], strict=True)])
        for h in halves
    ]
    assert source.size == 16
    # The second station's VT stands after all spectra of the catalogue, and is image 5 of a data
    # set of three spectra.
    expected = np.concatenate(
        [part[keep][:, [0, 5]] for part, keep in zip(views, kept, strict=True)]
    )
    assert (source.views(np.arange(len(source.facts))) == expected).all()
    assert set(zip(source.facts.group.tolist(), source.facts.fold.tolist(), strict=True)) == pairs
    assert (source.views(np.array([3, 1])) == expected[[3, 1]]).all()
    parts = [
        samples.ViewSamples([tmp_path / name], [0, len(NAMES) + 2], pairs)
        for name in ("0.npz", "1.npz")
    ]
    assert samples.joined_sources(*parts).sha256() == source.sha256()


def test_damaged_or_foreign_views_are_refused_by_name(tmp_path):
    found = facts()
    cache(tmp_path / "good.npz", found)
    cache(tmp_path / "other.npz", found, size=8)
    (tmp_path / "cut.npz").write_bytes((tmp_path / "good.npz").read_bytes()[:5000])
    np.savez(tmp_path / "foreign.npz", views=np.zeros(3))
    everything = {("seen", "train")}
    for names, words in (
        (["cut.npz"], "cut.npz"),
        (["foreign.npz"], "foreign.npz"),
        (["none.npz"], "none.npz"),
        (["good.npz", "other.npz"], "sizes"),
    ):
        with pytest.raises(InputError, match=words):
            samples.ViewSamples([tmp_path / name for name in names], [0], everything)
    with pytest.raises(InputError, match="none of the 1 files"):
        samples.ViewSamples([tmp_path / "good.npz"], [0], {("none", "train")})


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 3), st.integers(0, 50))
def test_an_epoch_visits_each_motion_model_as_often_as_asked(snrs, epoch):
    found = facts(models=7)
    drawn = batches.epoch_order(found, 5, ("seen", "A"), epoch, snrs)
    motion = np.char.add(found.subtype, found.model.astype(str))
    assert len(set(drawn.tolist())) == len(drawn)
    _, counts = np.unique(motion[drawn], return_counts=True)
    assert len(counts) == 7 * len(SUBTYPES)
    assert (counts == (snrs or len(SNRS))).all()
    assert (drawn == batches.epoch_order(found, 5, ("seen", "A"), epoch, snrs)).all()
    assert (drawn != batches.epoch_order(found, 5, ("seen", "A"), epoch + 1, snrs)).any()
    # Full batches, in the epoch's order; fewer samples than a batch are one.
    parts = batches.batches(drawn, 5)
    assert {len(part) for part in parts} == {5} and len(parts) == len(drawn) // 5
    assert np.concatenate(parts).tolist() == drawn[: 5 * len(parts)].tolist()
    assert [part.tolist() for part in batches.batches(drawn[:3], 5)] == [drawn[:3].tolist()]


def test_every_snr_is_drawn_evenly_over_epochs():
    found = facts()
    drawn = np.concatenate([batches.epoch_order(found, 5, (), epoch, 1) for epoch in range(60)])
    _, counts = np.unique(found.snr_db[drawn], return_counts=True)
    share = counts / counts.sum()
    assert np.abs(share - 1 / 3).max() < 4 * np.sqrt(2 / 9 / counts.sum())


def test_frozen_inputs_are_held_to_their_checksums(tmp_path):
    (tmp_path / "clouds").mkdir()
    for name in ("clouds/b.npz", "clouds/a.npz", "motion.csv"):
        (tmp_path / name).write_text(name)
    sums = tmp_path / "SHA256SUMS"
    freeze.freeze(
        [tmp_path / "motion.csv", tmp_path / "clouds/b.npz", tmp_path / "clouds/a.npz"], sums
    )
    assert freeze.verify(sums) == 3
    check = subprocess.run(["sha256sum", "--check", "--quiet", "SHA256SUMS"], cwd=tmp_path)
    assert check.returncode == 0
    (tmp_path / "clouds/a.npz").write_text("easier")
    with pytest.raises(InputError, match=r"clouds/a\.npz: has changed"):
        freeze.verify(sums)
    with pytest.raises(InputError, match="not below"):
        freeze.freeze([sys.executable], sums)
    for name in (sys.executable, "../motion.csv", "clouds/../../motion.csv"):
        sums.write_text(f"{'0' * 64}  {name}\n")
        with pytest.raises(
            InputError, match=f"SHA256SUMS line 1: '{name}', expected a file below {tmp_path}"
        ):
            freeze.verify(sums)
