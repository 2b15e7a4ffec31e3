"""A data set on a web server.

The same samples by byte ranges alone, the same checks, and refusals in one sentence.
"""

import contextlib
import json
import pickle
import shutil
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

from dataset import build
from lowalt.extensions.formats import web_files
from lowalt.files.errors import InputError
from lowalt.shards import ShardSet
from lowalt.shards.index import _checksum
from range_server import serving


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return build(tmp_path_factory.mktemp("remote") / "shards", "signal", inputs=False)


def damaged(path, place):
    """Change one byte of a file."""
    data = bytearray(path.read_bytes())
    data[place] ^= 1
    path.write_bytes(data)


def test_a_sample_is_read_by_its_bytes_alone_over_one_connection(folder):
    disk = ShardSet(folder / "index.json")
    with serving(folder) as server:
        shards = ShardSet(f"{server.address}/index.json")
        assert server.sent == {"index.json": (folder / "index.json").stat().st_size}
        sizes = {}
        for number in (len(disk) - 1, 0, 1):
            np.testing.assert_array_equal(shards.signal(number), disk.signal(number))
            shard, place = disk._locate(number)
            name = disk.shards[shard]["path"]
            sizes[name] = sizes.get(name, 0) + int(disk._table(shard)[place]["size"])
            sizes[name.replace(".tar", ".npz")] = (folder / name).with_suffix(".npz").stat().st_size
        assert {name: size for name, size in server.sent.items() if name != "index.json"} == sizes
        assert server.connections == 1
        np.testing.assert_array_equal(shards.keys, disk.keys)
        again = pickle.loads(pickle.dumps(shards))
        np.testing.assert_array_equal(again.images(3, size=32), disk.images(3, size=32))


def test_workers_that_are_forked_after_the_first_sample_do_not_share_its_connection(folder):
    torch = pytest.importorskip("torch")
    disk = ShardSet(folder / "index.json")
    with serving(folder) as server:
        shards = ShardSet(f"{server.address}/index.json")
        assert (shards.signal(0) == disk.signal(0)).all()

        class Signals(torch.utils.data.Dataset):
            """Signals of the samples, in memory of their own."""

            def __getitem__(self, number):
                return shards.signal(number).copy()

        loader = torch.utils.data.DataLoader(
            Signals(),
            sampler=range(len(disk)),
            num_workers=2,
            batch_size=None,
            multiprocessing_context="fork",
        )
        for number, found in enumerate(loader):
            assert (np.asarray(found) == disk.signal(number)).all()
        assert server.connections == 3


@pytest.mark.parametrize(
    ("name", "answer", "words"),
    [
        ("index.json", (404, {}), r"index\.json: the server answers 404 \(Not Found\)$"),
        ("index.json", (200, {}), "sends whole files only, expected one that sends byte ranges$"),
        (
            "index.json",
            (302, {"Location": "file:///etc/passwd"}),
            "the server leads to file:///etc/passwd, expected an address on the same host",
        ),
        ("index.json", (302, {"Location": "/index.json"}), "cannot be read .*redirects"),
        (
            "index.json",
            (302, {"Location": "http://127.0.0.2/index.json"}),
            "leads to http://127.0.0.2/index.json, expected an address on the same host",
        ),
        (
            "index.json",
            (307, {"Location": "http://127.0.0.1:9/index.json"}),
            "leads to http://127.0.0.1:9/index.json, expected an address on the same host",
        ),
        ("seen-test-00000.npz", (404, {}), r"/seen-test-00000\.npz: the server answers 404"),
        ("seen-test-00000.tar", (416, {}), r"/seen-test-00000\.tar: the server answers 416"),
        (
            "seen-test-00000.tar",
            (403, {}),
            r"/seen-test-00000\.tar: the server answers 403 \(Forbidden\)$",
        ),
    ],
)
def test_a_server_that_cannot_give_the_bytes_is_refused_by_address_and_answer(
    folder, name, answer, words
):
    with serving(folder, {name: answer}) as server, pytest.raises(InputError, match=words) as found:
        ShardSet(f"{server.address}/index.json", folds=["test"]).signal(0)
    assert str(found.value).startswith(f"{server.address}/{name}: ")


def test_a_server_that_is_not_there_is_refused(folder):
    with serving(folder) as server:
        pass
    with pytest.raises(InputError, match=r"index\.json: cannot be read .*refused"):
        ShardSet(f"{server.address}/index.json")


def test_a_server_of_https_may_not_lead_to_one_of_http(monkeypatch):
    class Answer(contextlib.nullcontext):
        """What a session returns for a redirect."""

        is_redirect = True
        headers: ClassVar = {"Location": "http://host/index.json"}

    monkeypatch.setattr(
        web_files,
        "_session",
        lambda process: SimpleNamespace(get=lambda *_, **__: Answer(Answer())),
    )
    with pytest.raises(
        InputError, match=r"^https://host/index\.json: the server leads to http://host/index\.json"
    ):
        ShardSet("https://host/index.json")


def test_damage_is_found_as_on_disk(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "copy")
    row = ShardSet(folder / "index.json", ["seen"], ["val"])._table(0)[0]
    damaged(copy / "seen-val-00000.tar", int(row["data_offset"]) + 200)
    damaged(copy / "seen-test-00000.npz", -300)
    with serving(copy) as server:
        address = f"{server.address}/index.json"
        with pytest.raises(
            InputError, match=rf"sample {row['key'].decode()} is damaged \(SHA-256 differs\)"
        ):
            ShardSet(address, ["seen"], ["val"]).signal(0)
        with pytest.raises(InputError, match=r"seen-test-00000\.npz: "):
            ShardSet(address, ["seen"], ["test"]).signal(0)
        # A file that ends too early.
        tar = copy / "seen-train-00000.tar"
        tar.write_bytes(tar.read_bytes()[:2000])
        with pytest.raises(InputError, match="is damaged"):
            ShardSet(address, ["seen"], ["train"]).signal(0)
        damaged(copy / "index.json", 300)
        with pytest.raises(InputError, match=rf"^{address}: "):
            ShardSet(address)


@pytest.mark.parametrize(
    "name", ["http://{host}/other.tar", "//{host}/other.tar", "other.tar?a#b", "%2e%2e/other.tar"]
)
def test_an_index_leads_to_no_file_but_those_below_its_folder(folder, tmp_path, name):
    """The name is a file's name, whatever it would mean as an address."""
    copy = shutil.copytree(folder, tmp_path / "site/inner")
    shutil.copy(copy / "seen-test-00000.npz", tmp_path / "site/other.npz")
    with serving(tmp_path / "site") as server:
        index = json.loads((copy / "index.json").read_text())
        index["shards"] = [
            index["shards"][2] | {"path": name.format(host=server.address.removeprefix("http://"))}
        ]
        index["sha256"] = _checksum(index)
        (copy / "index.json").write_text(json.dumps(index))
        with pytest.raises(InputError, match=r"the server answers 404|lies outside"):
            ShardSet(f"{server.address}/inner/index.json").signal(0)
        assert set(server.sent) <= {"index.json"} | {
            key for key, sent in server.sent.items() if not sent
        }


def test_the_files_of_an_index_are_asked_for_with_its_query():
    """The query holds the signature of an address that a store has signed."""
    assert (
        web_files.beside("https://host/a/index.json?key=1", "b c.tar")
        == "https://host/a/b%20c.tar?key=1"
    )
