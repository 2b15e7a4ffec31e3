"""What strangers bring through the doors of the extensions.

Recordings with their records, data sets on web servers, and files whose numbers a library warns of.
"""

import json
import shutil
import socket
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest
import yaml

from dataset import build
from lowalt.__main__ import main
from lowalt.extensions.recordings.__main__ import main as imported
from lowalt.extensions.recordings.files import read
from lowalt.extensions.recordings.record import read_record
from lowalt.extensions.recordings.twin_training import RECOGNITION, settings
from lowalt.files.errors import InputError, InputWarning, in_plain_characters
from lowalt.files.shipped import SHIPPED
from lowalt.files.yaml_files import load_yaml
from lowalt.shards import ShardSet
from range_server import serving

COMMON = "carrier_hz: 24.0e+9\nchannel: complex\nrate_hz: 12000\n"


@pytest.fixture
def recordings(tmp_path, monkeypatch):
    """A stranger's folder `theirs` of records, and recordings of the user elsewhere."""
    here = tmp_path / "here"
    secret = tmp_path / "secret"
    (here / "theirs").mkdir(parents=True)
    secret.mkdir()
    samples = np.exp(1j * np.arange(50_000) ** 1.2).astype(np.complex64)
    for folder in (secret, here / "theirs"):
        np.save(folder / "walk.npy", samples)
        samples.tofile(folder / "walk.sigmf-data")
        (folder / "targets.yaml").write_text("Crow: {source: builtin}\n")
        about = {"core:datatype": "cf32_le", "core:sample_rate": 12000, "core:version": "1.2.0"}
        text = json.dumps({"global": about, "captures": [], "annotations": []})
        (folder / "walk.sigmf-meta").write_text(text)
        other = json.dumps(
            {"global": about | {"core:dataset": "linked.bin"}, "captures": [], "annotations": []}
        )
        (folder / "other.sigmf-meta").write_text(other)
    (here / "theirs/link.npy").symlink_to(secret / "walk.npy")
    (here / "theirs/folder").symlink_to(secret)
    (here / "theirs/linked.bin").symlink_to(secret / "walk.sigmf-data")
    (here / "theirs/half.sigmf-meta").write_bytes((secret / "walk.sigmf-meta").read_bytes())
    (here / "theirs/half.sigmf-data").symlink_to(secret / "walk.sigmf-data")
    (here / "theirs/circle.npy").symlink_to("circle.npy")
    (here / "results").mkdir()
    (here / "results/zoo").symlink_to(SHIPPED / "results/zoo")
    monkeypatch.chdir(here)
    return here


RECORDS = {
    "by its absolute path": "file: {secret}/walk.npy\n",
    "above": "file: ../../secret/walk.npy\n",
    "above, in the working directory": "file: ../signals.npy\n",
    "above and back": "file: ../theirs/walk.npy\n",
    "through a folder and above": "file: folder/../../secret/walk.npy\n",
    "a link": "file: link.npy\n",
    "in a linked folder": "file: folder/walk.npy\n",
    "a link to itself": "file: circle.npy\n",
    "samples of SigMF by a link": "file: half.sigmf-meta\n",
    "metadata of SigMF that name a link": "file: other.sigmf-meta\n",
    "a device": "file: /dev/zero\n",
    "own targets elsewhere": "file: walk.npy\ntwin: {targets: ['{secret}/targets.yaml']}\n",
    "own targets above": "file: walk.npy\ntwin: {targets: [../../secret/targets.yaml]}\n",
    "own targets by a link": "file: walk.npy\ntwin: {targets: [folder/targets.yaml]}\n",
}
ENTRIES = {
    "read_record": lambda path: read(read_record(path)),
    "predict": lambda path: main(["predict", "cw_24ghz", path]),
    "recording train": lambda path: main(["recording", "train", path, "--out", "mine"]),
    "recordings import": lambda path: imported(
        ["import", "--record", path, "--radar", "cw_24ghz", "--out", "made"]
    ),
}


@pytest.mark.parametrize("attack", RECORDS)
@pytest.mark.parametrize("entry", ENTRIES)
def test_a_record_names_files_of_its_own_folder_alone(recordings, entry, attack, capsys):
    text = RECORDS[attack].replace("{secret}", str(recordings.parent / "secret"))
    Path("theirs/theirs.yaml").write_text(COMMON + text)
    try:
        assert ENTRIES[entry]("theirs/theirs.yaml") == 2
        told = capsys.readouterr().err
    except InputError as error:
        told = str(error)
    assert told.strip().count("\n") == 0 and len(told) <= 450
    assert "in its own folder or below" in told or "expected the name of a file" in told


@pytest.mark.parametrize(
    ("key", "value"), [("backbone", "net.py:run"), ("weights", "hub"), ("weights", "weights.pt")]
)
def test_the_default_that_a_file_of_recognition_names_has_no_code_and_no_weights(
    recordings, key, value
):
    default = load_yaml(SHIPPED / "config/default.yaml")
    default["recognition"]["network"][key] = value
    Path("theirs/scene.yaml").write_text(yaml.safe_dump(default))
    block = load_yaml(SHIPPED / RECOGNITION)
    Path("mine.yaml").write_text(yaml.safe_dump(block | {"default": "theirs/scene.yaml"}))
    with pytest.raises(InputError, match=r"theirs/scene\.yaml: its .*may not choose"):
        settings("mine.yaml")
    Path("mine.yaml").write_text(yaml.safe_dump(block))
    assert settings("mine.yaml") == settings()


@pytest.mark.parametrize("name", ["walk.npy", "./walk.npy", "walk.sigmf-meta"])
def test_a_recording_beside_its_record_or_below_is_read(recordings, name):
    Path("theirs/theirs.yaml").write_text(f"{COMMON}file: {name}\n")
    assert len(read(read_record("theirs/theirs.yaml")).values) == 50_000
    Path("theirs.yaml").write_text(f"{COMMON}file: theirs/{name}\n")
    assert len(read(read_record("theirs.yaml")).values) == 50_000


def test_a_draft_stands_where_it_may_name_its_recording(recordings, capsys):
    secret = recordings.parent / "secret"
    asked = f"recording inspect {secret}/walk.npy --carrier 24e9 --rate 12000".split()
    assert main([*asked, "--out", "mine.yaml"]) == 2
    assert "expected a record in the recording's folder or above" in capsys.readouterr().err
    assert main(asked) == 0
    assert len(read(read_record(secret / "walk.yaml")).values)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A small data set of signals."""
    return build(tmp_path_factory.mktemp("remote") / "shards", "signal", inputs=False)


def test_a_remote_table_is_named_by_its_address(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "copy")
    table = copy / "seen-test-00000.npz"
    whole = table.read_bytes()
    for damage in (
        b"",
        whole[:100],
        whole[:-50],
        b"PK" + bytes(300),
        whole.replace(b"key", b"kez"),
    ):
        table.write_bytes(damage)
        with serving(copy) as server, pytest.raises(InputError) as refused:
            ShardSet(f"{server.address}/index.json", ["seen"], ["test"]).signal(0)
        told = str(refused.value)
        assert told.startswith(f"{server.address}/seen-test-00000.npz: ")
        assert "tmp" not in told


@pytest.mark.parametrize("status", ["404 \x1b[31mred\x1b]0;owned\x07", "500 a\x9bb", "206 \x1b[2J"])
def test_a_reason_phrase_s_control_characters_do_not_reach_the_terminal(status):
    listener = socket.create_server(("127.0.0.1", 0))

    def answer() -> None:
        """Answer each request with the status, until the listener is closed."""
        while True:
            try:
                line, _ = listener.accept()
            except OSError:
                return
            line.recv(65536)
            line.sendall(f"HTTP/1.1 {status}\r\nContent-Length: 0\r\n\r\n".encode("latin-1"))
            line.close()

    threading.Thread(target=answer, daemon=True).start()
    with listener, pytest.raises(InputError) as refused:
        ShardSet(f"http://127.0.0.1:{listener.getsockname()[1]}/index.json")
    told = str(refused.value)
    assert "\n" not in told and in_plain_characters(told) == told


PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""


def odd_town() -> list[str]:
    """A town whose corners are infinite."""
    Path("box.ply").write_text(PLY)
    shape = '<shape type="ply"><string name="filename" value="box.ply"/>'
    scaled = '<transform name="to_world"><scale value="inf"/></transform></shape>'
    Path("town.xml").write_text(f'<scene version="3.0.0">{shape}{scaled}</scene>')
    return ["scene", "inspect", "town.xml"]


def odd_sigmf() -> list[str]:
    """A SigMF recording whose annotation ends behind its samples."""
    np.zeros(64, np.complex64).tofile("a.sigmf-data")
    about = {"core:datatype": "cf32_le", "core:sample_rate": 12000, "core:version": "1.2.0"}
    annotation = {"core:sample_start": 0, "core:sample_count": 10_000}
    block = {"global": about, "captures": [{"core:sample_start": 0}], "annotations": [annotation]}
    Path("a.sigmf-meta").write_text(json.dumps(block))
    Path("a.yaml").write_text(f"{COMMON}file: a.sigmf-meta\n")
    return ["predict", f"{SHIPPED}/results/zoo/cw_24ghz.safetensors", "a.yaml"]


@pytest.mark.parametrize("odd", [odd_town, odd_sigmf])
def test_no_warning_of_a_library_stands_before_the_sentence(odd, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = odd()
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        assert main(words) == 2
    assert not [one for one in heard if not issubclass(one.category, InputWarning)]
    assert capsys.readouterr().err.strip().count("\n") == 0
