"""Other people's tools read the shards: the hub's library, Croissant's and SigMF's."""

import csv
import json
import os
import re
from datetime import UTC, datetime

import numpy as np
import pytest
import yaml

from dataset import CONFIG, build
from hub_library import loaded
from lowalt.extensions.formats.sigmf import main as sigmf
from lowalt.files.errors import InputError
from lowalt.shards import ShardSet
from lowalt.shards.card import main as card
from lowalt.shards.croissant import FIELDS, RESPONSIBLE


@pytest.fixture(scope="module", params=["image", "signal"])
def published(request, tmp_path_factory):
    folder = build(tmp_path_factory.mktemp(request.param) / "shards", request.param, inputs=False)
    (folder.parent / "config.yaml").write_text(yaml.safe_dump(CONFIG))
    card(
        [
            "--index",
            str(folder / "index.json"),
            "--config",
            str(folder.parent / "config.yaml"),
            "--date",
            "2026-01-31",
            "--url",
            "https://example.org/trial",
        ]
    )
    return folder


def test_the_hubs_library_reads_every_protocol_by_the_card(published, tmp_path, monkeypatch):
    shards = ShardSet(published / "index.json")
    numbers = {key.decode(): number for number, key in enumerate(shards.keys.tolist())}
    counts = {
        "seen": {"train": 12, "validation": 6, "test": 6},
        "unseen": {"train": 8, "validation": 4, "test": 8},
    }
    for protocol, expected in counts.items():
        found = loaded(published, tmp_path, monkeypatch, protocol)
        assert {split: len(rows) for split, rows in found.items()} == expected
        assert found["test"].features["json"]["label"].names == list(shards.classes)
        for row in found["test"]:
            number = numbers[row["__key__"]]
            assert row["json"] == shards.record(number)
            if shards.kind == "signal":
                stored = np.array(row["npy"], np.float32).view(np.complex64)[..., 0]
                assert (stored == shards.signal(number)).all()
            else:
                assert (np.asarray(row["png"]) == shards.tile(number)).all()


def text(value):
    """A cell of text, which the reference implementation gives as bytes."""
    return value.decode() if isinstance(value, bytes) else value


def test_croissant_is_valid_and_its_first_record_unpacks_no_shard(published, mlcroissant):
    """Every cell of the card's records is that of the table of samples.

    All required and recommended properties are there.
    """
    data = mlcroissant.Dataset(str(published / "croissant.json"))
    assert not data.metadata.issues.errors
    assert not data.metadata.issues.warnings
    assert data.metadata.conforms_to == [
        "http://mlcommons.org/croissant/1.1",
        "http://mlcommons.org/croissant/RAI/1.0",
    ]
    assert f"{data.metadata.date_published:%Y-%m-%d}" == "2026-01-31"
    assert [record_set.uuid for record_set in data.metadata.record_sets] == ["samples"]
    with (published / "samples.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    found = list(data.records("samples"))
    assert len(rows) == len(ShardSet(published / "index.json")) == len(found)
    for record, row in zip(found, rows, strict=True):
        for name, (data_type, _) in FIELDS.items():
            kind = {"sc:Text": text, "sc:Integer": int, "sc:Float": float}[data_type]
            assert kind(record[f"samples/{name}"]) == kind(row[name]), name
    from mlcroissant._src.operation_graph.operations import extract

    assert not extract.EXTRACT_PATH.exists()


def test_the_responsible_ai_properties_are_words_of_the_vocabulary(published, mlcroissant):
    """The reference implementation reads each of them back by its own name."""
    metadata = mlcroissant.Dataset(str(published / "croissant.json")).metadata
    for name, value in RESPONSIBLE.items():
        assert getattr(metadata, re.sub("([A-Z])", r"_\1", name).lower()) == value, name


def test_a_description_without_a_date_has_the_day_of_the_index(published):
    folder = published.parent
    day = datetime(2025, 3, 4, tzinfo=UTC).timestamp()
    before = (published / "croissant.json").read_bytes()
    times = (published / "index.json").stat()
    os.utime(published / "index.json", (day, day))
    card(f"--index {published}/index.json --config {folder}/config.yaml".split())
    assert json.loads((published / "croissant.json").read_text())["datePublished"] == "2025-03-04"
    os.utime(published / "index.json", (times.st_atime, times.st_mtime))
    (published / "croissant.json").write_bytes(before)


def test_sigmf_recordings_hold_every_signal_with_its_annotation(published, tmp_path):
    shards = ShardSet(published / "index.json")
    arguments = f"--index {published}/index.json --out {tmp_path}".split()
    if shards.kind == "image":
        with pytest.raises(InputError, match="expected 'signal'"):
            sigmf(arguments)
        return
    library = pytest.importorskip("sigmf")
    sigmf(arguments)
    network = shards.index["render"]["network"]
    for place, station in enumerate(network["stations"]):
        recording = library.sigmffile.fromfile(str(tmp_path / f"{station}.sigmf-meta"))
        recording.validate()
        assert recording.get_global_field("core:datatype") == "cf32_le"
        assert recording.get_global_field("core:sample_rate") == 1 / network["symbol_interval_s"]
        assert recording.get_capture_info(0)["core:frequency"] >= network["carrier_hz"]
        annotations = recording.get_annotations()
        assert len(annotations) == len(shards)
        for number in (0, 5, len(shards) - 1):
            note = annotations[number]
            signal = recording.read_samples(note["core:sample_start"], note["core:sample_count"])
            assert (signal == shards.signal(number)[place]).all()
            assert note["lowalt:key"] == shards.keys[number].decode()
