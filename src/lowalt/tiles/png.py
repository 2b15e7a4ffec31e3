"""Palette PNG: 8-bit index images with their colour map, written small and fast, read back exactly.

Spectra are resampled, so a pixel is nearly the plane through its neighbours: every row has the
Paeth filter, and its differences an entropy code of our own (`lowalt.tiles.huffman`). Pixels, and
bytes, are the same on every machine.
"""

import io
import struct

import deflate
import numpy as np
from PIL.PngImagePlugin import PngImageFile

from lowalt.files.errors import InputError
from lowalt.machine.jit import PLAIN
from lowalt.tiles.huffman import zlib_compress

MOST_EXPANSION = 1032
"""Most bytes that one byte of a zlib stream gives.

Source: RFC 1951, a match of 258 bytes takes at least two bits.
"""
SIGNATURE = b"\x89PNG\r\n\x1a\n"
PAETH = 4
"""Number of the filter type, which begins each filtered row."""


HEADER = struct.Struct(">IIBBBBB")
"""Width, height, bits per pixel, colour type, compression, filters, interlacing."""
DEPTH = 8
OF_PALETTE = 3
"""Bits per pixel, and the colour type whose pixels are indices into a palette."""


def _chunk(name: bytes, body: bytes) -> bytes:
    """A chunk of a PNG: length, name, body, checksum."""
    checksum = struct.pack(">I", deflate.crc32(name + body))
    return struct.pack(">I", len(body)) + name + body + checksum


@PLAIN
def apply_paeth(image, out):
    """Filter image (H, W) uint8 into out (H, W + 1) uint8.

    Filter type 4 is the pixel minus the Paeth predictor.

    Source: PNG specification (W3C, third edition), section 9.
    """
    height, width = image.shape
    for r in range(height):
        line = out[r]
        row = image[r]
        line[0] = PAETH
        if r == 0:
            line[1] = row[0]
            for c in range(1, width):
                line[c + 1] = row[c] - row[c - 1]
            continue
        up = image[r - 1]
        line[1] = row[0] - up[0]
        for c in range(1, width):
            a = np.int16(row[c - 1])
            b = np.int16(up[c])
            d = np.int16(up[c - 1])
            to_a = np.int16(abs(b - d))
            to_b = np.int16(abs(a - d))
            to_d = np.int16(abs(np.int16(a + b) - np.int16(d + d)))
            if to_a <= to_b and to_a <= to_d:
                best = a
            elif to_b <= to_d:
                best = b
            else:
                best = d
            line[c + 1] = np.uint8(np.int16(row[c]) - best)


def encode(image: np.ndarray, palette: np.ndarray) -> bytes:
    """Return the PNG file of an index image (H, W) uint8 with a palette (256, 3) uint8.

    Raises: InputError where the image is empty or not uint8.
    Source: PNG specification (W3C, third edition), colour type 3, filter type 4.
    """
    if image.dtype != np.uint8 or image.ndim != 2 or image.size == 0:
        raise InputError(f"image: {image.dtype} {image.shape}, expected uint8 (H, W)")
    height, width = image.shape
    rows = np.empty((height, width + 1), np.uint8)
    apply_paeth(image, rows)
    return packed(image.shape, palette, zlib_compress(rows))


def packed(shape: tuple[int, int], palette: np.ndarray, stream: bytes) -> bytes:
    """Return the PNG file of an 8-bit palette image (H, W) from the zlib stream of its rows.

    The rows are filtered.
    """
    height, width = shape
    header = HEADER.pack(width, height, DEPTH, OF_PALETTE, 0, 0, 0)
    colours = np.ascontiguousarray(palette).tobytes()
    chunks = [
        _chunk(b"IHDR", header),
        _chunk(b"PLTE", colours),
        _chunk(b"IDAT", stream),
        _chunk(b"IEND", b""),
    ]
    return SIGNATURE + b"".join(chunks)


def _chunks(data: bytes) -> list[tuple[bytes, memoryview]]:
    """Name and body of every chunk, checksums tested.

    Raises: InputError where the bytes are no PNG, a checksum is wrong or the end is missing.
    """
    if data[:8] != SIGNATURE:
        raise InputError("image: no PNG signature, expected a palette PNG")
    view = memoryview(data)
    start = 8
    chunks = []
    # A chunk has its length in 4 bytes, its name in 4, its body, and a checksum in 4.
    while start + 12 <= len(data):
        size = int.from_bytes(view[start : start + 4], "big")
        end = start + 12 + size
        if end > len(data):
            break
        checksum = int.from_bytes(view[end - 4 : end], "big")
        if deflate.crc32(view[start + 4 : end - 4]) != checksum:
            break
        name = bytes(view[start + 4 : start + 8])
        chunks.append((name, view[start + 8 : end - 4]))
        if name == b"IEND":
            return chunks
        start = end
    raise InputError(f"image: the PNG is damaged or cut off at byte {start}")


def decode(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Return index image (H, W) uint8 and palette (256, 3) uint8 of a palette PNG.

    Whoever wrote the file.

    Raises: InputError where the bytes are no 8-bit palette PNG or are damaged.
    """
    chunks = _chunks(data)
    name, header = chunks[0]
    if name != b"IHDR" or len(header) != HEADER.size:
        header = memoryview(bytes(HEADER.size))
    width, height, depth, colour, *_ = HEADER.unpack(header)
    if (depth, colour) != (DEPTH, OF_PALETTE):
        raise InputError(
            f"image: PNG of bit depth {depth} and colour type {colour}, expected an 8-bit palette "
            "PNG"
        )
    palette = np.zeros((256, 3), np.uint8)
    for name, body in chunks:
        if name == b"PLTE":
            if len(body) % 3 or len(body) > palette.size:
                raise InputError(
                    f"image: a palette of {len(body)} bytes, expected up to 256 colours of three "
                    "bytes"
                )
            table = np.frombuffer(body, np.uint8).reshape(-1, 3)
            palette[: len(table)] = table
    packed = sum(len(body) for name, body in chunks if name == b"IDAT")
    if not width * height or height * (width + 1) > MOST_EXPANSION * (packed + 1):
        raise InputError(
            f"image: {width} x {height} pixels in {packed} bytes, expected a size that fits them"
        )
    try:
        # `Image.open` refuses large images, which are tiles here.
        with PngImageFile(io.BytesIO(data)) as picture:
            return np.array(picture), palette
    except (OSError, ValueError, SyntaxError) as error:
        raise InputError(f"image: the PNG's pixels cannot be unpacked ({error})") from error
