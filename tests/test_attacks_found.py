"""Damaged files on which a reader once ended with a traceback or without the file's name: each is
refused by name.
"""

import zipfile

import numpy as np
import pytest
import torch

from craft import craft
from fuzzed_seals import ARCHIVE, PNG
from lowalt.files.atomic import existing
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.motion.table import COLUMNS, read_table
from lowalt.recognition import checkpoint, freeze, schemes
from lowalt.recognition.predict_sample import images_of
from lowalt.shards.sample_table import SAMPLE, map_samples
from lowalt.shards.sample_table import write as write_table
from lowalt.targets.cloud import read as read_cloud
from lowalt.targets.cloud import write as write_cloud
from lowalt.targets.records import load_table
from lowalt.tiles.png import SIGNATURE, decode, encode
from lowalt.tiles.tile_files import Tiles
from lowalt.tiles.tile_files import write as write_tiles


def encoded(height: int, width: int) -> bytes:
    """A good palette PNG of this size."""
    return encode(np.zeros((height, width), np.uint8), np.zeros((256, 3), np.uint8))


@pytest.mark.parametrize("reads", [read_csv, lambda path: schemes.read(path, "ABC"), load_table])
@pytest.mark.parametrize(("cells", "count"), [("1", 1), ("1,2,3,4", 4)])
def test_a_line_of_a_table_with_other_cells_than_columns_is_refused(reads, cells, count, tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(f"scheme,name,note\nx,y,z\n{cells}\n")
    with pytest.raises(InputError, match=rf"table\.csv line 3: {count} cells, expected 3"):
        reads(path)


def test_a_number_of_a_motion_model_beyond_floating_point_is_refused(tmp_path):
    path = tmp_path / "motion.csv"
    cells = ["9" * 400 if name == "model" else "1" for name in COLUMNS]
    path.write_text(f"{','.join(COLUMNS)}\n{','.join(cells)}\n")
    with pytest.raises(
        InputError, match=r"line 2, column model: '9+ \.\.\. 9+', expected a number"
    ):
        read_table(path)


def test_a_name_that_no_file_can_have_is_that_of_no_file(tmp_path):
    with pytest.raises(InputError, match=r"frozen file: no file at .*too long"):
        existing(tmp_path / ("9" * 5000), "frozen file")


def test_a_frozen_file_whose_name_has_a_null_byte_is_refused(tmp_path):
    path = tmp_path / "SHA256SUMS"
    path.write_text(f"{'0' * 64}  clouds/a\0.npz\n")
    with pytest.raises(
        InputError, match=r"SHA256SUMS line 1: 'clouds/a\\x00\.npz', expected a file below"
    ):
        freeze.verify(path)


@pytest.mark.parametrize("offsets", [[0, 9, 4, 6], [0, 2, 4, 7], [0, -2, 4, 6], []])
def test_offsets_that_do_not_part_the_tiles_are_refused(offsets, tmp_path):
    path = tmp_path / "tiles.npz"
    write_tiles(path, [b"ab", b"cd", b"ef"])
    assert [Tiles(path)[number] for number in range(3)] == [b"ab", b"cd", b"ef"]
    np.savez(path, data=np.frombuffer(b"abcdef", np.uint8), offsets=np.array(offsets, "<i8"))
    with pytest.raises(InputError, match=r"tiles\.npz: offsets\.npy does not part"):
        Tiles(path)


def test_a_checkpoint_whose_pickle_ends_early_is_refused(tmp_path):
    whole = tmp_path / "whole.pt"
    path = tmp_path / "cut.pt"
    checkpoint.save(whole, "{}", {"weights": {"a": torch.ones(5)}})
    with zipfile.ZipFile(whole) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, b"\x80\x02." if name.endswith("data.pkl") else old.read(name))
    with pytest.raises(InputError, match=r"cut\.pt: not a checkpoint"):
        checkpoint.load(path)


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("a.png", encoded(90, 99), "tile: 90 x 99 pixels, expected rows of 3 square images"),
        ("a.png", encoded(40, 100), "tile: 40 x 100 pixels, expected rows of 3 square images"),
        ("a.png", encoded(33, 100), "tile: 33 x 100 pixels, expected rows of 3 square images"),
        ("a.png", encoded(3, 2), "tile: 3 x 2 pixels, expected rows of 3 square images"),
        ("a.png", b"", "no PNG signature"),
        (
            "a.npy",
            np.zeros((3, 400)),
            r"float64 \(3, 400\), expected complex \(stations, symbols\)",
        ),
        (
            "a.npy",
            np.zeros(400, complex),
            r"complex128 \(400,\), expected complex \(stations, symbols\)",
        ),
        (
            "a.npy",
            np.zeros((2, 400), complex),
            r"signals have shape \(2, 400\), expected \(3, 400\)",
        ),
        ("a.npy", np.full((3, 400), np.nan, complex), "NaN or infinite"),
        ("a.npy", b"x", "not a whole signals file"),
        ("a.wav", b"x", r"expected signals \(.npy\) or a tile \(.png\)"),
    ],
)
def test_what_is_no_sample_is_refused_by_its_file(name, content, expected, tmp_path):
    path = tmp_path / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        np.save(path, content)
    config = load_yaml("config/default.yaml")
    with pytest.raises(InputError, match=f"{path}: .*{expected}"):
        images_of(path, {key: config[key] for key in ("network", "spectra", "images")})


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("points", b"no array at all", "the magic string is not correct"),
        (
            "record",
            np.array([4294967295], "u4").view("U1"),
            "its text has the code 4294967295, which is no character",
        ),
        (
            "points",
            np.full((20, 3), 1e300),
            "points has a coordinate that is no number within 1000 m",
        ),
        ("points", np.full((20, 3), "a"), "points has values of type <U1, expected numbers"),
        ("part", np.zeros(20), "part has values of type float64, expected numbers"),
        ("rcs_m2", np.full(20, 1e300), "rcs_m2 has a value that is no number from 0 to 1e[+]09 m2"),
    ],
    ids=["bytes", "no character", "far", "text", "parts by halves", "huge"],
)
def test_a_cloud_of_what_are_no_numbers_or_none_that_a_target_has_is_refused(
    name, content, expected, tmp_path
):
    path = tmp_path / "a.npz"
    write_cloud(path, craft())
    parts = ARCHIVE.opened(path.read_bytes())
    if isinstance(content, np.ndarray):
        np.save(tmp_path / "a.npy", content)
        content = (tmp_path / "a.npy").read_bytes()
    path.write_bytes(ARCHIVE.closed(parts | {f"{name}.npy": content}))
    with pytest.raises(InputError, match=rf"a\.npz: .*{expected}"):
        read_cloud(path)


@pytest.mark.parametrize("count", [7, 10**15, -1])
def test_a_table_that_says_it_is_longer_than_its_file_is_refused(count, tmp_path):
    path = tmp_path / "a.npz"
    write_table(path, {}, np.zeros(6, SAMPLE))
    assert len(map_samples(path)) == 6
    path.write_bytes(path.read_bytes().replace(b"'shape': (6,)", f"'shape': ({count},)".encode()))
    with pytest.raises(InputError, match=r"a\.npz: no array samples\.npy"):
        map_samples(path)


def test_an_interlaced_image_without_its_pixels_is_refused():
    parts = PNG.opened(encoded(24, 24))
    name = next(iter(parts))
    cut = PNG.closed(parts | {name: parts[name][:12] + b"\1", "2 IDAT": b""})
    assert cut.startswith(SIGNATURE)
    with pytest.raises(InputError, match="image: "):
        decode(cut)
