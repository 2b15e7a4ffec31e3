"""The picture of the first page: one clean tile of each category out of a finished run, two by two
at half size.

python docs/tiles_picture.py INDEX OUT
"""

import io
import sys

import numpy as np
from PIL import Image

from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.report.figures.tile_axes import example_tiles
from lowalt.shards import ShardSet

GAP = 12
"""Pixels of white between two tiles."""


def cover(tiles: list[bytes]) -> Image.Image:
    """Return four PNG tiles as one palette picture, two by two at half size.

    Raises: InputError where there are not four.
    """
    if len(tiles) != 4:
        raise InputError(f"cover: {len(tiles)} tiles, expected one of each of the four categories")
    # Box reduction of colours keeps lines one pixel wide visible; 256 colours keep the file small.
    halves = [Image.open(io.BytesIO(data)).convert("RGB").reduce(2) for data in tiles]
    side = halves[0].width
    page = Image.fromarray(np.full((2 * side + GAP, 2 * side + GAP, 3), 255, np.uint8))
    for index, half in enumerate(halves):
        page.paste(half, ((index % 2) * (side + GAP), (index // 2) * (side + GAP)))
    return page.quantize(128, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)


def main(arguments: list[str]) -> None:
    """Write the picture."""
    index, out = arguments
    with replacing(out) as temporary:
        cover([data for _, data in example_tiles(ShardSet(index, folds=["test"]))]).save(
            temporary, optimize=True
        )


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except InputError as error:
        raise SystemExit(f"error: {error}") from None
