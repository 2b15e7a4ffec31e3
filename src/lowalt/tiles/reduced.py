"""Reduced images of a chunk, made from its tiles while these are still pixels.

No PNG has to be decoded for them.

A file (.npy) holds (samples, views, size, size) uint8 in the order of the tiles file: `resize` of
the views of every tile, the same bytes as from the decoded PNG, since PNG loses nothing.
"""

import contextlib
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from lowalt.files.array_files import array_of
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.tiles.render import split
from lowalt.tiles.resample import resize

_TARGET = re.compile(r"([1-9]\d*)=(.+)", re.DOTALL)


def target(text: str) -> tuple[int, Path]:
    """Return size (pixels per side) and path of a reduced file from the text "SIZE=PATH".

    Raises: InputError where the text has another form.
    """
    parts = _TARGET.fullmatch(text)
    if not parts:
        raise InputError(f"--reduced {text!r}: expected SIZE=PATH, such as 24=reduced.npy")
    return int(parts[1]), Path(parts[2])


@contextlib.contextmanager
def writing(
    targets: list[tuple[int, Path]], samples: int, stations: int, spectra: int
) -> Iterator[Callable[[int, np.ndarray], None]]:
    """Open reduced files; yield a function (number, tile) that writes one sample into all of them.

    targets: size (pixels per side) and path of each file; a tile is (stations S, spectra S) uint8.
    The files appear under their names when the block ends without an error.
    """
    with contextlib.ExitStack() as stack:
        arrays = []
        for size, path in targets:
            temporary = stack.enter_context(replacing(path))
            shape = (samples, stations * spectra, size, size)
            arrays.append(np.lib.format.open_memmap(temporary, "w+", np.uint8, shape))

        def fill(number: int, tile: np.ndarray) -> None:
            """Write the reduced images of one sample's tile into all files."""
            if not arrays:
                return
            images = split(tile, spectra)
            for array in arrays:
                array[number] = resize(images, array.shape[-1])

        yield fill
        for array in arrays:
            array.flush()


def read(path: str | Path, size: int, samples: int) -> np.ndarray:
    """Return a reduced file as a read-only memory map, (samples, views, size, size) uint8.

    Raises: InputError naming the file where it is missing, damaged, or of other samples or another
    size.
    """
    images = array_of(path, "reduced images", mapped=True)
    if (
        images.dtype != np.uint8
        or images.ndim != 4
        or (images.shape[0], *images.shape[2:]) != (samples, size, size)
    ):
        raise InputError(
            f"{path}: {images.dtype} {images.shape}, expected uint8 ({samples}, views, {size}, "
            f"{size})"
        )
    return images
