"""The PNG encoder: Huffman codes and filters against zlib, Pillow and the rules of the format."""

import io
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from lowalt.files.errors import InputError
from lowalt.tiles import colour_map, decode, encode, paint
from lowalt.tiles.huffman import zlib_compress
from lowalt.tiles.huffman_code import code_lengths

BYTES = [
    np.zeros(0, np.uint8),
    np.full(1, 7, np.uint8),
    np.zeros(100_003, np.uint8),
    np.arange(256, dtype=np.uint8),
    np.repeat(np.arange(200, dtype=np.uint8) % 3, 411),
    # Fibonacci-like counts ask for codes of 24 bits, more than the 15 that the format has.
    np.concatenate([np.full(int(1.618**k) + 1, k, np.uint8) for k in range(25)]),
]


@pytest.mark.parametrize("data", BYTES, ids=lambda d: str(d.size))
def test_zlib_reads_what_we_write(data):
    assert zlib.decompress(zlib_compress(data)) == data.tobytes()


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 4000),
    st.integers(0, 2**32 - 1),
    st.sampled_from([1, 2, 30, 256]),
    st.floats(0, 1),
)
def test_zlib_reads_random_bytes_with_runs(size, seed, levels, zeros):
    rng = np.random.default_rng(seed)
    data = rng.integers(0, levels, size).astype(np.uint8)
    # Runs of zeros of many lengths, at any offset.
    for _ in range(int(4 * zeros)):
        start = rng.integers(0, size + 1)
        length = rng.integers(0, 700)
        data[start : start + length] = 0
    assert zlib.decompress(zlib_compress(data)) == data.tobytes()


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(0, 10**6), min_size=2, max_size=286), st.sampled_from([9, 15]))
def test_code_lengths_are_a_code_as_short_as_can_be(counts, longest):
    counts = np.array(counts)
    lengths = code_lengths(counts, longest)
    used = counts > 0
    assert ((lengths > 0) == used).all() and lengths.max() <= longest
    if used.sum() < 2:
        return
    # A complete prefix code fills the Kraft sum, and Huffman's comes within one bit a symbol of the
    # entropy.
    assert sum(2.0 ** -lengths[used]) == 1
    share = counts[used] / counts.sum()
    entropy = -(share * np.log2(share)).sum()
    assert entropy - 1e-9 <= (share * lengths[used]).sum()
    if longest == 15 and counts[used].min() * 1000 > counts.sum():
        assert (share * lengths[used]).sum() <= entropy + 1


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(0, 2**32 - 1), st.sampled_from([2, 256]))
def test_png_gives_the_pixels_back_to_us_and_to_pillow(height, width, seed, levels):
    image = np.random.default_rng(seed).integers(0, levels, (height, width)).astype(np.uint8)
    palette = colour_map("viridis")
    data = encode(image, palette)
    found, colours = decode(data)
    np.testing.assert_array_equal(found, image)
    np.testing.assert_array_equal(colours, palette)
    with Image.open(io.BytesIO(data)) as picture:
        assert picture.mode == "P"
        np.testing.assert_array_equal(np.asarray(picture), image)
        np.testing.assert_array_equal(np.asarray(picture.convert("RGB")), paint(image, palette))


def test_pngs_of_others_are_read():
    image = np.random.default_rng(2).integers(0, 100, (40, 30), np.uint8)
    picture = Image.fromarray(image)
    picture.putpalette(colour_map("magma").tobytes())
    buffer = io.BytesIO()
    picture.save(buffer, "PNG", optimize=True)
    found, palette = decode(buffer.getvalue())
    np.testing.assert_array_equal(paint(found, palette), paint(image, colour_map("magma")))


def test_damaged_or_other_images_are_refused():
    data = encode(np.arange(256, dtype=np.uint8).reshape(16, 16), colour_map("gray"))
    gray = io.BytesIO()
    Image.new("L", (4, 4)).save(gray, "PNG")
    flipped = [
        data[:place] + bytes([data[place] ^ 4]) + data[place + 1 :]
        for place in range(0, len(data), 37)
    ]
    for bad in (b"", data[:60], data[:-12], b"GIF89a", gray.getvalue(), *flipped):
        with pytest.raises(InputError, match="image"):
            decode(bad)
    with pytest.raises(InputError, match="float64"):
        encode(np.zeros((3, 3)), colour_map("gray"))


def test_bytes_of_an_image_are_fixed():
    """The encoder's bytes are a promise.

    They are equal on every machine and with every version of every library.
    """
    image = (np.add.outer(np.arange(64) ** 2, 3 * np.arange(96)) // 7 % 256).astype(np.uint8)
    image[20:40] = 9
    assert zlib.crc32(encode(image, colour_map("gray"))) == 4084249925


def test_weak_is_dark_violet_and_strong_is_yellow():
    # The ends of viridis in red, green and blue (Smith and van der Walt 2015).
    colours = paint(np.array([[0, 255]], np.uint8), colour_map("viridis"))
    assert colours.tolist() == [[[68, 1, 84], [253, 231, 36]]]
