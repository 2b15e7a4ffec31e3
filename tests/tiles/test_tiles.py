"""Images of spectra: the resampling kernel, the scales, the fused renderer, PNG, commands."""

import json
import re
import zipfile
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import reference_spectra as reference
from lowalt.files.errors import InputError
from lowalt.spectra import trp, vrp, vt
from lowalt.tiles import Images, Scale, join, resize, split, tile_files, triangle
from lowalt.tiles.__main__ import main
from lowalt.tiles.render import normalised
from lowalt.tiles.scale import lookup
from options import words
from pictures import IMAGES, NETWORK, SCALES, SPECTRA, echoes, renderer


def index(values, scale, signed):
    """Index images by counting the thresholds that each value over the largest one reaches."""
    steps = np.searchsorted(
        scale.thresholds(127 if signed else 255), np.abs(values) / np.abs(values).max(), "right"
    )
    return np.where(values < 0, 128 - steps, 128 + steps) if signed else steps


@pytest.mark.parametrize(
    ("size", "out"),
    [(5, 5), (5, 8), (9, 4), (144, 256), (392, 256), (1024, 256), (256, 224), (1, 3)],
)
def test_triangle_is_its_formula(size, out):
    values = np.random.default_rng(size).standard_normal(size)
    np.testing.assert_allclose(
        triangle(size, out) @ values, reference.resampled_line(values, out), atol=1e-12
    )


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 90), st.integers(1, 90))
def test_laws_of_the_triangle(size, out):
    weights = triangle(size, out)
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-12)
    assert (weights >= 0).all()
    # Turning the axis round before or after is the same: images turn rows round after the
    # definition.
    np.testing.assert_allclose(weights, weights[::-1, ::-1], atol=1e-12)
    if size == out:
        np.testing.assert_array_equal(weights, np.eye(size))


@pytest.mark.parametrize("scale", SCALES, ids=lambda s: f"{s.name}{s.floor_db:g}")
@pytest.mark.parametrize("signed", [False, True])
def test_index_is_the_formula(scale, signed):
    values = np.random.default_rng(1).standard_normal((40, 40)) ** 3
    values = values if signed else np.abs(values)
    expected = reference.index_image(values[::-1], signed, scale.name, scale.floor_db, scale.gamma)
    np.testing.assert_array_equal(index(values, scale, signed), expected)


@pytest.mark.parametrize("scale", [*SCALES, Scale("power", gamma=2.0), Scale("decibel", 140.0)])
@pytest.mark.parametrize("levels", [127, 255])
def test_lookup_counts_thresholds_exactly(scale, levels):
    """On both sides of every threshold and between, the tables give the count itself."""
    table = lookup(scale, levels)
    thresholds = scale.thresholds(levels).astype(np.float32)
    edges = [
        thresholds,
        np.nextafter(thresholds, np.float32(0)),
        np.nextafter(thresholds, np.float32(2)),
    ]
    x = np.minimum(
        np.concatenate([*edges, np.linspace(0, 1, 9999, dtype=np.float32)]), np.float32(1)
    )
    keys = np.maximum(x.view(np.int32) - table.lowest, 0) >> table.shift
    found = table.base[keys] + (x >= table.cut[keys])
    np.testing.assert_array_equal(found, np.searchsorted(thresholds, x, side="right"))


@pytest.mark.parametrize("scale", SCALES, ids=lambda s: f"{s.name}{s.floor_db:g}")
def test_renderer_agrees_with_the_definition(scale):
    """float32 against the float64 definition: at most one level off, and seldom."""
    signals = echoes()
    tiles = renderer(scale)
    found = split(tiles.tile(signals), 3).astype(int)
    for station in range(3):
        carrier = tiles.network.stations[station].frequency_hz
        spectra = (
            vrp(signals[station]),
            trp(signals[station]),
            vt(signals[station], carrier, 2.5e-3),
        )
        for view, values in enumerate(spectra):
            resampled = triangle(values.shape[0], 256) @ values @ triangle(values.shape[1], 256).T
            expected = index(resampled[::-1], scale, signed=view == 2)
            off = np.abs(found[3 * station + view] - expected)
            assert off.max() <= 1
            assert (off > 0).mean() < 1e-3


def test_orientation_of_axes():
    """Row 0 is the most positive value, time runs right, stations go down, spectra go right."""
    times = np.arange(400)
    rising = np.exp(2j * np.pi * 100 * 2.5e-3 * times) * (times > 200)
    receding = np.exp(-4j * np.pi * 4.9e9 * 4.0 * 2.5e-3 * times / 299792458) * (times % 50 < 25)
    tile = renderer(Scale("linear")).tile(
        np.stack([rising, receding, 0 * rising]).astype(np.complex64)
    )
    images = split(tile, 3)
    # 100 Hz of the +-200 Hz stands a quarter from the top and only in the second half of the time.
    assert abs(int(images[1][:, 200].argmax()) - 64) <= 1
    assert images[1][:, :120].max() == 0
    # A receding speed is a negative frequency, in the lower half of the Fourier images, but
    # positive in the VT.
    assert images[3].sum(axis=1).argmax() > 128
    assert np.abs(images[5].astype(int) - 128).sum(axis=1).argmax() < 128
    assert (images[6] == 0).all() and (images[8] == 128).all()
    np.testing.assert_array_equal(tile[:256, 256:512], images[1])
    np.testing.assert_array_equal(join(images, 3), tile)


@pytest.mark.parametrize("scale", SCALES, ids=lambda s: f"{s.name}{s.floor_db:g}")
def test_zero_and_constant_signals_have_defined_images(scale):
    tiles = renderer(scale)
    zero = split(tiles.tile(np.zeros((3, 400), np.complex64)), 3)
    assert (zero[[0, 1, 3, 4, 6, 7]] == 0).all()
    assert (zero[[2, 5, 8]] == 128).all()
    constant = split(tiles.tile(np.full((3, 400), 0.25 + 0.5j, np.complex64)), 3)
    # Frequency zero is bin 128 from below, row 127 from above; nothing changes along time.
    assert (constant[0][127] == 255).all() and (constant[0][[126, 128]] == 0).all()
    assert (constant == constant[..., :1]).all()
    flat = np.full((9, 9), 3.0)
    assert (index(flat, scale, signed=False) == 255).all()
    assert (index(-flat, scale, signed=True) == 1).all()


@pytest.mark.parametrize("snr_db", [-60, 200, np.inf])
def test_extreme_snrs_have_defined_images(snr_db):
    clean = echoes(1, snr=0)
    grain = np.random.default_rng(2).standard_normal((2, 3, 400))
    noise = 1e-7 * 10 ** (-snr_db / 20) * (grain[0] + 1j * grain[1]) / np.sqrt(2)
    images = split(renderer().tile((clean + noise).astype(np.complex64)), 3)
    assert ((images.max(axis=(1, 2)) == 255) | (images.min(axis=(1, 2)) == 1)).all()
    if snr_db == 200:
        np.testing.assert_array_equal(images, split(renderer().tile(clean), 3))


@pytest.mark.parametrize("level", [1e-36, 1e-30, 1e-12, 1.0, 1e30])
def test_the_level_of_a_signal_changes_no_pixel(level):
    """A power of two between two signals is no difference, however small or large they are."""
    signals = echoes(4, level=1.0)
    power = 2.0 ** np.round(np.log2(level))
    np.testing.assert_array_equal(
        renderer().tile((signals * power).astype(np.complex64)), renderer().tile(signals)
    )
    assert (
        0.5
        <= np.abs(np.concatenate([normalised(signals[0]).real, normalised(signals[0]).imag])).max()
        < 1
    )


def test_pixels_depend_on_the_signal_alone():
    first = echoes(5)
    second = echoes(6)
    tiles = renderer()
    alone = tiles.tile(first)
    tiles.tile(second)
    np.testing.assert_array_equal(tiles.tile(first), alone)
    np.testing.assert_array_equal(tiles.tile(first[[1, 0, 2]])[512:], alone[512:])


def test_refusals_name_what_is_wrong():
    with pytest.raises(InputError, match=r"spectrum vrp.*256"):
        renderer(symbols=256)
    with pytest.raises(InputError, match=r"\(2, 400\)"):
        renderer().tile(echoes()[:2])
    bad = echoes()
    bad[1, 7] = np.inf
    with pytest.raises(InputError, match="infinite"):
        renderer().tile(bad)
    for change, named in [
        ({"scale": "log"}, "log"),
        ({"floor_db": 0}, "floor_db"),
        ({"gamma": 9}, "gamma"),
        ({"size": 0}, "size"),
        ({"colour_map": "rainbows"}, "rainbows"),
        ({"sise": 3}, "sise"),
    ]:
        with pytest.raises(InputError, match=named):
            Images.from_settings({**IMAGES, **change})


def test_pixels_of_a_signal_are_fixed():
    """The renderer's pixels are a promise.

    They are equal on every machine and with every version of every library.
    """
    steps = np.arange(1200, dtype=np.int64).reshape(3, 400)
    signals = ((steps**3 % 257 - 128) + 1j * (steps**2 % 251 - 125)).astype(np.complex64)
    assert zlib.crc32(renderer().tile(signals).tobytes()) == 4171406068


@settings(max_examples=20, deadline=None)
@given(st.integers(2, 80), st.integers(0, 2**32 - 1))
def test_resize_is_pillows_on_index_values(size, seed):
    image = np.random.default_rng(seed).integers(0, 256, (64, 64), np.uint8)
    pillow = np.asarray(
        Image.fromarray(image.astype(np.float32)).resize((size, size), Image.Resampling.BILINEAR)
    )
    off = np.abs(resize(image, size) - pillow)
    assert off.max() <= 0.5 + 1e-3
    np.testing.assert_array_equal(resize(np.stack([image] * 2), size)[1], resize(image, size))


def test_tiles_file_keeps_every_image(tmp_path):
    images = [bytes([number]) * (number * 7) for number in range(5)]
    assert tile_files.write(tmp_path / "tiles.npz", iter(images)) == (5, 70)
    found = tile_files.Tiles(tmp_path / "tiles.npz")
    assert [found[number] for number in range(len(found))] == images
    with np.load(tmp_path / "tiles.npz") as plain:
        assert plain["data"].tobytes() == b"".join(images)
        assert plain["offsets"].tolist() == [0, 0, 7, 21, 42, 70]
    assert zipfile.ZipFile(tmp_path / "tiles.npz").testzip() is None
    with pytest.raises(IndexError):
        found[5]
    (tmp_path / "bad.npz").write_bytes((tmp_path / "tiles.npz").read_bytes()[:-20])
    with pytest.raises(InputError, match=r"bad\.npz"):
        tile_files.Tiles(tmp_path / "bad.npz")


@pytest.mark.parametrize(
    ("symbols", "save", "name"),
    [(300, np.save, "noisy.npy"), (NETWORK["symbols"], np.savez, "noisy.npz")],
    ids=["other symbols than the network's", "an archive of arrays"],
)
def test_signals_that_do_not_fit_are_refused_and_nothing_is_left(symbols, save, name, tmp_path):
    save(tmp_path / name, np.zeros((2, 2, 3, symbols), np.complex64))
    block = json.dumps({"network": NETWORK, "spectra": SPECTRA, "images": IMAGES})
    out = tmp_path / "chunk.npz"
    with pytest.raises(InputError, match=re.escape(name)):
        main(words(settings=block, signals=tmp_path / name, out=out))
    assert not out.exists()
