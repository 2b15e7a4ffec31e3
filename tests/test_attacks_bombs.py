"""Files that would fill the memory, take minutes or never end: each is refused in one sentence
before it does.
"""

import io
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
import torch

import bombs
from lowalt.files.array_files import array_of
from lowalt.files.atomic import bytes_of, existing
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.files.json_objects import read_object
from lowalt.files.yaml_files import load_yaml
from lowalt.motion.table import read_table
from lowalt.recognition import checkpoint, predictions
from lowalt.shards import index, kept_datasets, sample_table, verify
from lowalt.targets import mesh_collada
from lowalt.targets.cloud import read as read_cloud
from lowalt.targets.mesh_files import read_mesh
from lowalt.targets.mocap_files import read_skeleton
from lowalt.targets.mocap_joints import read_bvh
from made_indexes import index_of


def mesh(path: Path) -> object:
    """Read a mesh in metres."""
    return read_mesh(path, "m")


def json_of(path: Path) -> object:
    """Read a JSON object."""
    return read_object(path, "an object")


def numbers(path: Path) -> object:
    """Read one array."""
    return array_of(path, "numbers")


def archive(members: int, size: int) -> bytes:
    """An archive of arrays of zeros, which share nothing and compress well."""
    array = io.BytesIO()
    np.save(array, np.zeros(size // 8))
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as made:
        for number in range(members):
            made.writestr(f"{number}.npy", array.getvalue())
    return file.getvalue()


def long_array() -> bytes:
    """An array file whose header states eight gigabytes."""
    file = io.BytesIO()
    np.save(file, np.zeros(4))
    return file.getvalue().replace(b"(4,)", b"(1000000000,)")


YAML_PARTS = "a: " + "1:" * 20_000 + "1"
BVH = "HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 0 }"
ROWS = [
    bombs.Bomb(
        "a.yaml", YAML_PARTS, load_yaml, "not YAML .*expected a whole number of at most 64 bits"
    ),
    bombs.Bomb(
        "b.yaml", "a: 0x" + "f" * 4000, load_yaml, "expected a whole number of at most 64 bits"
    ),
    bombs.Bomb("c.yaml", lambda: "a: 1\n" * 300_000, load_yaml, "over 200000 lines and commas"),
    bombs.Bomb(
        "d.yaml", lambda: "a: [" + "1," * 300_000, load_yaml, "over 200000 lines and commas"
    ),
    bombs.Bomb(
        "e.yaml", lambda: "#" * (5 << 20), load_yaml, "5242880 bytes, expected a configuration"
    ),
    bombs.Bomb(
        "a.json", lambda: '{"a": [' + "[],[[[" * 900_000, json_of, "more than 4000000 values"
    ),
    bombs.Bomb("b.json", '{"a": 1' + "0" * 3000 + "}", json_of, "a whole number of 3001 digits"),
    bombs.Bomb(
        "a.csv", lambda: "," * 1_000_000, read_csv, "1000001 columns, expected a table of at most"
    ),
    bombs.Bomb(
        "b.csv", lambda: "a" * 3_000_000, read_csv, "a line of more than 1048576 characters"
    ),
    bombs.Bomb(
        "c.csv", lambda: "," * 9_000_000, read_table, "a line of more than 1048576 characters"
    ),
    bombs.Bomb("d.csv", lambda: "a" * 3_000_000, predictions.read, "a line of more than 1048576"),
    bombs.Bomb("a.npy", long_array, numbers, "mmap length is greater than file size"),
    bombs.Bomb(
        "a.npz", lambda: archive(4, 17 << 20), read_cloud, "4 members of 713.* bytes in all"
    ),
    bombs.Bomb("a.obj", "f" + " 1" * 600_000, mesh, "a line of more than 1048576 characters"),
    bombs.Bomb("b.obj", lambda: bombs.obj_star(40_000), mesh, "dents and up to 40000 corners"),
    bombs.Bomb("c.obj", lambda: bombs.obj_star(10_000, 11), mesh, "dents and up to 10000 corners"),
    bombs.Bomb("d.obj", lambda: "f 1 1 1 \\\n" * 200_000, mesh, "line 1 is continued too often"),
    bombs.Bomb(
        "a.dae", bombs.collada_of_nodes(40), mesh, "more than 20000.. triangles, expected fewer"
    ),
    bombs.Bomb(
        "b.dae", bombs.collada_of_nodes(40).replace("#n38", "#n39"), mesh, "more than 20000.. tri"
    ),
    bombs.Bomb(
        "a.stl", bytes(80) + struct.pack("<I", 2**31) + bytes(99), mesh, "ends after 1, expected"
    ),
    bombs.Bomb(
        "a.bvh", BVH + "MOTION\nFrames: 9999999\nFrame Time: 0.01\n", read_bvh, "too many joints"
    ),
    bombs.Bomb("a.asf", lambda: ":" * 3_000_000, read_skeleton, "a line of more than 1048576"),
]


@pytest.mark.parametrize("row", ROWS, ids=[f"{row.name} {row.read.__name__}" for row in ROWS])
def test_a_file_that_asks_for_far_more_than_it_holds_is_refused_in_one_sentence(row, tmp_path):
    bombs.check_refused(row, tmp_path)


def test_an_xml_file_of_more_elements_than_a_mesh_has_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_collada, "MOST_ELEMENTS", 1000)
    path = tmp_path / "a.dae"
    path.write_text(f"<COLLADA>{'<a/>' * 999}</COLLADA>")
    with pytest.raises(InputError, match=r"has no triangle|not a readable"):
        mesh(path)
    path.write_text(f"<COLLADA>{'<a/>' * 997}<a b='' c='' d=''/></COLLADA>")
    with pytest.raises(InputError, match=r"a\.dae: .*more than 1000 elements and attributes"):
        mesh(path)


READERS = {
    "a.yaml": load_yaml,
    "a.json": json_of,
    "a.csv": read_csv,
    "b.csv": read_table,
    "a.npy": numbers,
    "a.npz": read_cloud,
    "b.npz": sample_table.map_samples,
    "a.obj": mesh,
    "a.stl": mesh,
    "a.dae": mesh,
    "a.asf": read_skeleton,
    "a.bvh": read_bvh,
    "index.json": index.load,
}


@pytest.mark.parametrize("name", READERS)
def test_pipes_and_devices_are_no_files(name, tmp_path):
    bombs.pipe(tmp_path / name)
    (tmp_path / f"zero-{name}").symlink_to("/dev/zero")
    for path in (tmp_path / name, tmp_path / f"zero-{name}"):
        with pytest.raises(
            InputError, match="is a pipe, socket or device, expected a regular file"
        ):
            READERS[name](path)


def test_a_file_is_read_up_to_the_size_that_it_states(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(bytes(10))
    assert bytes_of(path, "thing", 10) == bytes(10) and existing(path, "thing") == path
    with pytest.raises(InputError, match=f"{path}: 10 bytes, expected a thing of at most 9"):
        bytes_of(path, "thing", 9)
    with pytest.raises(InputError, match="/proc/self/status: longer than the 0 bytes of its size"):
        bytes_of("/proc/self/status", "thing", 9)
    with pytest.raises(InputError, match="thing: no file at"):
        existing(tmp_path, "thing")


@pytest.mark.parametrize(
    ("text", "value"),
    [("1:30", 90), ("0x1F", 31), ("-18446744073709551615", 1 - 2**64), ("1_000", 1000)],
)
def test_whole_numbers_of_64_bits_are_read_as_before(text, value, tmp_path):
    (tmp_path / "a.yaml").write_text(f"a: {text}")
    assert load_yaml(tmp_path / "a.yaml") == {"a": value}


def shard_table(folder: Path, **changes: int) -> Path:
    """A table of two samples, some of whose numbers are changed."""
    rows = np.zeros(2, sample_table.SAMPLE)
    rows["size"] = rows["data_size"] = 100
    for name, value in changes.items():
        rows[name][1] = value
    sample_table.write(folder / "a.npz", {}, rows)
    return folder / "a.npz"


@pytest.mark.parametrize(
    "changes",
    [{"size": 2**62}, {"size": -1}, {"offset": -1}, {"data_size": 2**40}, {"record_offset": 2**62}],
)
def test_a_table_whose_samples_are_larger_than_any_is_refused(changes, tmp_path):
    assert len(sample_table.map_samples(shard_table(tmp_path))) == 2
    path = shard_table(tmp_path, **changes)
    with pytest.raises(InputError, match=rf"{path}: row 1 has a place or a size .*expected sizes"):
        sample_table.map_samples(path)
    (tmp_path / "a.tar").write_bytes(bytes(1024))
    entry = {"bytes": 1024, "sha256": "", "table_sha256": "", "samples": 2}
    assert [*verify.shard_faults(tmp_path / "a.tar", entry)]


@pytest.mark.parametrize(
    ("samples", "expected"), [(2**62, "expected at most 10000000"), (2**70, "64 bits")]
)
def test_an_index_of_more_samples_than_a_table_holds_is_refused(samples, expected, tmp_path):
    assert index.load(index_of(tmp_path, samples=5))["shards"][0]["samples"] == 5
    with pytest.raises(InputError, match=rf"index\.json: .*{expected}"):
        index.load(index_of(tmp_path, samples=samples))


def test_a_checkpoint_of_lists_within_lists_is_refused(tmp_path):
    state = [1.0]
    for _ in range(40):
        state = [state, state]
    torch.save({"identity": "{}", "digest": "", "state": state}, tmp_path / "a.pt")
    said = bombs.refusal_of(lambda: checkpoint.load(tmp_path / "a.pt"))
    assert said.startswith(f"{tmp_path}/a.pt: not a checkpoint (values of more than 67108864 bytes")


def test_a_checkpoint_that_is_compressed_beyond_measure_is_refused(tmp_path):
    checkpoint.save(tmp_path / "a.pt", "{}", {"a": torch.zeros(17 << 20)})
    with (
        zipfile.ZipFile(tmp_path / "a.pt") as old,
        zipfile.ZipFile(tmp_path / "b.pt", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as new,
    ):
        for name in old.namelist():
            new.writestr(name, old.read(name))
    said = bombs.refusal_of(lambda: checkpoint.load(tmp_path / "b.pt"))
    assert "b.pt: not a checkpoint (its members expand to more than 67108864 bytes" in said


def test_a_configuration_that_names_a_pipe_or_a_device_is_not_read_from_it(tmp_path):
    bombs.pipe(tmp_path / "pipe")
    (tmp_path / "file").write_text("a")
    assert kept_datasets._state(tmp_path / "file") is not None
    for path in (tmp_path / "pipe", Path("/dev/zero"), tmp_path):
        assert kept_datasets._state(path) is None
