"""SigMF recordings of the samples of shards.

What the metadata say of a station and of a sample is that station's and that sample's own.
"""

import hashlib
import json
import math

import numpy as np
import pytest

from dataset import RENDER, motion_rows, pack
from dataset import build as write_shards
from lowalt.extensions.formats.sigmf import main
from lowalt.shards import ShardSet
from lowalt.shards.index import build
from lowalt.shards.sample_record import sample_key
from pictures import NETWORK

PARTS = {
    ("seen", "train"): slice(0, 5),
    ("seen", "val"): slice(5, 8),
    ("unseen", "test"): slice(0, 2),
}


@pytest.fixture(scope="module")
def index(tmp_path_factory):
    """Five, three and two samples in shards of their own."""
    folder = tmp_path_factory.mktemp("shards")
    shards = [
        pack(folder / f"{group}-{fold}-0.tar", motion_rows(group)[part], fold)
        for (group, fold), part in PARTS.items()
    ]
    build(shards, RENDER, folder / "index.json")
    return folder / "index.json"


def metadata(folder, station):
    return json.loads((folder / f"{station}.sigmf-meta").read_text())


def test_every_recording_tells_its_own_station(index, tmp_path):
    main(f"--index {index} --out {tmp_path}".split())
    assert len(list(tmp_path.iterdir())) == 2 * 3
    for place, (name, station) in enumerate(NETWORK["stations"].items()):
        found = metadata(tmp_path, name)
        told = found["global"]
        data = (tmp_path / f"{name}.sigmf-data").read_bytes()
        assert told["lowalt:station"] == name and told["core:description"].endswith(
            f" base station {name}"
        )
        assert told["lowalt:position_m"] == station["position_m"]
        assert told["lowalt:normal_rad"] == math.radians(station["normal_deg"])
        assert told["core:sha512"] == hashlib.sha512(data).hexdigest()
        # Each station's band of 256 subcarriers begins behind that of the station before it and 10
        # of a guard.
        (capture,) = found["captures"]
        assert capture == {
            "core:sample_start": 0,
            "core:frequency": 4.9e9 + place * (256 - 1 + 10) * 120e3,
        }


def test_every_annotation_is_its_own_sample_s_seen_from_the_recording_s_station(index, tmp_path):
    main(f"--index {index} --out {tmp_path}".split())
    made = [row for group, fold in PARTS for row in motion_rows(group)[PARTS[group, fold]]]
    rows = {sample_key(row["subtype"], row["model"], 3.0): row for row in made}
    keys = [key.decode() for key in ShardSet(index).keys.tolist()]
    assert sorted(rows) == sorted(keys) and len({row["model"] for row in rows.values()}) == 4
    for name, station in NETWORK["stations"].items():
        notes = metadata(tmp_path, name)["annotations"]
        assert [note["lowalt:key"] for note in notes] == keys
        for number, note in enumerate(notes):
            row = rows[note["lowalt:key"]]
            assert (note["core:sample_start"], note["core:sample_count"]) == (400 * number, 400)
            assert (note["core:label"], note["core:comment"]) == (
                row["category"],
                f"{row['subtype']}, motion model {row['model']}",
            )
            distance = math.dist([row["x_m"], row["y_m"], row["z_m"]], station["position_m"])
            assert note["lowalt:geometry"]["range_m"] == pytest.approx(distance, rel=1e-12)


def test_only_the_groups_and_folds_asked_for_are_exported(index, tmp_path):
    asked = (
        ["--groups", "seen", "--folds", "val"],
        ["--folds", "train", "test"],
        ["--groups", "unseen", "--folds", "train"],
    )
    for given, parts in zip(asked, (["seen val"], ["seen train", "unseen test"], []), strict=True):
        main(["--index", str(index), *given, "--out", str(tmp_path)])
        notes = metadata(tmp_path, "B")["annotations"]
        assert sorted({f"{note['lowalt:group']} {note['lowalt:fold']}" for note in notes}) == parts
        assert len(np.fromfile(tmp_path / "B.sigmf-data", np.complex64)) == 400 * len(notes)


def test_recipe_shards_are_exported_as_the_signals_they_stand_for(tmp_path):
    folder = write_shards(tmp_path / "shards", "recipe")
    main(f"--index {folder}/index.json --out {tmp_path}/sigmf".split())
    shards = ShardSet(folder / "index.json")
    signals = np.stack([shards.signal(number) for number in range(len(shards))])
    for place, name in enumerate(NETWORK["stations"]):
        stored = np.fromfile(tmp_path / f"sigmf/{name}.sigmf-data", np.complex64)
        assert (stored == signals[:, place].ravel()).all() and abs(stored).max() > 0
