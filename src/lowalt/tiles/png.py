"""Palette PNG: 8-bit index images with their colour map, written by libdeflate, read back exactly.

Every row has the sub filter (difference to the pixel on the left): spectra are smooth, so differences are small.
libdeflate's level 1 gives the same bytes on every machine; other encoders follow the CPU.
"""

import io
import struct

import deflate
import numpy as np
from PIL import Image

from lowalt.errors import InputError

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def _chunk(name: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", deflate.crc32(name + body))


def encode(image: np.ndarray, palette: np.ndarray) -> bytes:
    """Return the PNG file of an index image (H, W) uint8 with a palette (256, 3) uint8.

    Source: PNG specification (W3C, third edition), colour type 3, filter type 1.
    """
    height, width = image.shape
    rows = np.empty((height, width + 1), np.uint8)
    rows[:, 0] = 1
    rows[:, 1] = image[:, 0]
    np.subtract(image[:, 1:], image[:, :-1], out=rows[:, 2:])
    header = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    body = bytes(deflate.zlib_compress(rows, 1))
    colours = np.ascontiguousarray(palette).tobytes()
    return SIGNATURE + b"".join(
        _chunk(*part) for part in ((b"IHDR", header), (b"PLTE", colours), (b"IDAT", body), (b"IEND", b""))
    )


def decode(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Return index image (H, W) uint8 and palette (256, 3) uint8 of a palette PNG, whoever wrote it.

    Raises: InputError where the bytes are no 8-bit palette PNG or are damaged.
    """
    try:
        with Image.open(io.BytesIO(data)) as image:
            if image.format != "PNG" or image.mode != "P":
                raise InputError(f"image: {image.format} {image.mode}, expected a palette PNG")
            colours = image.getpalette("RGB")
            pixels = np.array(image)
    except (OSError, ValueError, SyntaxError, struct.error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"image: not a PNG that can be read ({error})") from error
    palette = np.zeros((256, 3), np.uint8)
    table = np.array(colours, np.uint8).reshape(-1, 3)
    palette[: len(table)] = table
    return pixels, palette
