"""The data card: its counts are those of the shards, and its description of them can be loaded by
others.
"""

import csv
import hashlib
import json
import math
import re
import shutil

import pytest
import yaml

import lowalt
from dataset import CONFIG, RENDER, SEED, SPLIT, build, motion_rows
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.shards import ShardSet, card
from lowalt.shards.card import main, readme
from lowalt.shards.croissant import metadata
from lowalt.shards.index import build as index_of
from lowalt.shards.write import ChunkSamples, write_shard
from options import words
from tables import rows


def make_card(folder, **options):
    """The card of the data set in a folder, dated a fixed day; config.yaml is in the same folder."""
    given = {"index": folder / "index.json", "config": folder / "config.yaml"}
    given |= {"date": "2026-01-31", "url": "https://example.org/trial"}
    main(words(**given | options))


@pytest.fixture(scope="module", params=["image", "signal"])
def published(request, tmp_path_factory):
    folder = build(tmp_path_factory.mktemp(request.param), request.param)
    (folder / "config.yaml").write_text(yaml.safe_dump(CONFIG))
    make_card(folder)
    return folder


def test_card_has_counts_configuration_and_versions(published):
    text = (published / "README.md").read_text()
    front = yaml.safe_load(text.split("---")[1])
    assert front["pretty_name"] == "lowalt-trial" and front["license"] == "mit"
    for row in (
        "| seen | train | 8 |",
        "| unseen | test | 2 |",
        "| Bird | Crow | seen | 8 |",
        "| inf | 12 |",
    ):
        assert row in text
    assert yaml.safe_load(text.split("```yaml")[1].split("```")[0]) == CONFIG
    versions = ShardSet(published / "index.json").record(0)["versions"]
    assert all(f"| {name} | {version} |" in text for name, version in versions.items())
    shard = re.search(r'WebDataset\("([^"]+)"', text)[1]
    assert (published / shard).is_file()
    for word in ("Known limits", "Oddities", "Licence", "verify"):
        assert word in text


@pytest.mark.parametrize(
    ("run", "name", "version"),
    rows("cards", "versions"),
)
def test_only_a_frozen_run_gives_its_data_set_a_version_and_a_card_with_rules(
    published, tmp_path, run, name, version
):
    folder = shutil.copytree(published, tmp_path / "shards")
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(CONFIG | {"run": run}))
    make_card(folder, config=tmp_path / "config.yaml")
    described = json.loads((folder / "croissant.json").read_text())
    assert (described["name"], described["version"]) == (name, version)
    card_text = (folder / "README.md").read_text()
    assert (
        f"# {name}\n" in card_text and f"lowalt\n{lowalt.__version__} wrote this page" in card_text
    )
    assert ("docs/benchmark-rules.md" in card_text) == (version != "0.2.0")


def test_samples_are_all_listed(published):
    shards = ShardSet(published / "index.json")
    rows = list(csv.DictReader((published / "samples.csv").open()))
    assert len(rows) == len(shards)
    for number, row in enumerate(rows):
        entry = shards.record(number)
        assert {name: row[name] for name in ("key", "category", "subtype", "group", "fold")} == {
            name: entry[name] for name in ("key", "category", "subtype", "group", "fold")
        }
        assert (int(row["label"]), int(row["model"])) == (entry["label"], entry["model"])
        assert (entry["snr_db"], entry["noise"]) == (
            (math.inf, False) if row["snr_db"] == "inf" else (float(row["snr_db"]), True)
        )
        assert row["key"].encode() in (published / row["shard"]).read_bytes()


def test_checksums_of_the_description_are_right(published):
    files = [
        node
        for node in json.loads((published / "croissant.json").read_text())["distribution"]
        if "sha256" in node
    ]
    assert len(files) == 7
    for node in files:
        data = (published / node["contentUrl"]).read_bytes()
        assert node["sha256"] == hashlib.sha256(data).hexdigest()
        assert node["contentSize"] == f"{len(data)} B"


def test_a_card_names_the_spectra_and_sizes_that_its_tiles_have(tmp_path):
    """Two stations and one spectrum: tiles of one column and two rows."""
    stations = {name: RENDER["network"]["stations"][name] for name in "AB"}
    render = {
        "network": RENDER["network"] | {"stations": stations},
        "spectra": {"trp": RENDER["spectra"]["trp"]},
        "images": RENDER["images"],
    }
    entry = {
        "name": "seen-train-0.tar",
        "path": "seen-train-0.tar",
        "sha256": "0",
        "bytes": 1,
        "samples": 1,
        "group": "seen",
        "fold": "train",
    }
    index = {"kind": "image", "shards": [entry], "render": render}
    found = metadata(index, {"path": "samples.csv", "bytes": 1, "sha256": "0"}, {})
    (images,) = [entry for entry in found["distribution"] if entry["name"] == "images"]
    assert (
        images["description"]
        == "256 x 512 palette PNG of every sample: rows are stations, columns TRP."
    )
    rows = [motion_rows("seen")[0] | {"fold": "train"}]
    network = Network.from_settings(render["network"])
    chunk = ChunkSamples(rows, [3.0], SPLIT, SEED, network)
    write_shard(tmp_path / "seen-train-0.tar", chunk, "train", "image", lambda *_: (b"", {}))
    index_of([tmp_path / "seen-train-0.tar"], render, tmp_path / "index.json")
    shards = ShardSet(tmp_path / "index.json")
    assert "1 samples as 2 x 1 tiles of" in card.description(shards)
    text = readme(shards, "run: x", "x", "MIT")
    assert "rows are the stations, columns TRP;" in text and "# (2, 224, 224) uint8" in text


def test_the_licence_asked_for_stands_in_every_file_and_another_is_refused(published, tmp_path):
    copy = shutil.copytree(published, tmp_path / "copy")
    make_card(copy, license="CC-BY-4.0")
    assert (
        "CC-BY-4.0 (https://creativecommons.org/licenses/by/4.0/)"
        in (copy / "README.md").read_text()
    )
    assert (
        yaml.safe_load((copy / "README.md").read_text().split("---")[1])["license"] == "cc-by-4.0"
    )
    assert (
        json.loads((copy / "croissant.json").read_text())["license"]
        == "https://creativecommons.org/licenses/by/4.0/"
    )
    before = (copy / "README.md").read_bytes()
    with pytest.raises(
        InputError, match=r"--license: 'WTFPL', expected one of \['CC-BY-4.0', 'MIT'\]"
    ):
        card.write(copy / "index.json", copy / "config.yaml", "WTFPL")
    assert (copy / "README.md").read_bytes() == before


def test_equal_data_sets_have_equal_cards(published, tmp_path):
    copy = shutil.copytree(published, tmp_path / "copy")
    before = {
        name: (copy / name).read_bytes() for name in ("README.md", "samples.csv", "croissant.json")
    }
    make_card(copy)
    assert before == {name: (copy / name).read_bytes() for name in before}
    with pytest.raises(InputError, match="nowhere"):
        make_card(copy, config=tmp_path / "nowhere.yaml")
