"""Data sets that lowalt 0.1.0 wrote still open; what cannot be done with them names the version
that made them.

`data/format_1` has two samples of one motion model, as signals and as images, written by version
0.1.0.
"""

import io
import json
import math
import shutil
import tarfile
from pathlib import Path

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.recognition.views import cache_shard, facts_of
from lowalt.shards import ShardSet, card
from lowalt.shards.remake import opened
from lowalt.shards.sample_record import row_of
from lowalt.shards.verify import faults, shard_faults

OLD = Path(__file__).parents[1] / "data" / "format_1"


@pytest.mark.parametrize("kind", ["signal", "image"])
def test_samples_of_the_first_format_are_read(kind, tmp_path):
    shards = ShardSet(OLD / kind / "index.json")
    assert (shards.index["format"], shards.kind, len(shards)) == ("lowalt-shards-1", kind, 2)
    assert sorted(key.decode() for key in shards.keys) == [
        "crow-000000-snr003",
        "crow-000000-snrinf",
    ]
    assert sorted(shards.snrs_db.tolist()) == [3.0, math.inf]
    assert {record["snr_db"] for record in map(shards.record, range(2))} == {3.0, "inf"}
    facts = facts_of(shards, np.arange(2))
    assert facts.subtype.tolist() == ["Crow", "Crow"] and facts.range_m[0, 0] == pytest.approx(
        math.hypot(40, 60, 25)
    )
    assert math.isfinite(facts.aspect_rad[0, 0])
    assert (
        cache_shard(OLD / kind / "index.json", "seen-train-00000.tar", 8, tmp_path / "views.npz")
        == 2
    )
    assert list(shard_faults(OLD / kind / "seen-train-00000.tar", shards.index["shards"][0])) == []


def test_old_signals_are_complex_and_make_the_old_pixels():
    signals, images = (ShardSet(OLD / kind / "index.json") for kind in ("signal", "image"))
    with tarfile.open(OLD / "signal" / "seen-train-00000.tar") as archive:
        for number in range(2):
            stored = np.load(
                io.BytesIO(archive.extractfile(f"{signals.keys[number].decode()}.npy").read())
            )
            assert stored.dtype == np.complex64 and stored.shape == (1, 16)
            assert (signals.signal(number) == stored).all()
            assert (signals.tile(number) == images.tile(number)).all() and signals.tile(
                number
            ).any()


def test_what_an_old_data_set_lacks_is_said_with_the_version_that_made_it(tmp_path):
    with pytest.raises(
        InputError, match=r"lowalt 0\.2 or later wrote, found format lowalt-shards-1"
    ):
        opened(OLD / "signal" / "index.json", tmp_path)
    with pytest.raises(InputError, match=r"record of lowalt 0\.1\.0, expected of 0\.2 or later"):
        row_of(ShardSet(OLD / "image" / "index.json").record(0))


def test_an_old_data_set_gets_a_card_of_its_own_version(tmp_path):
    folder = shutil.copytree(OLD / "image", tmp_path / "shards")
    (tmp_path / "config.yaml").write_text(json.dumps({"run": "old"}))
    card.write(folder / "index.json", tmp_path / "config.yaml")
    assert "| lowalt | 0.1.0 |" in (folder / "README.md").read_text()
    assert list(faults(folder / "index.json")) == []
