"""Colour maps: the 256 colours that the index values stand for, and RGB images from index images."""

from functools import lru_cache

import numpy as np

from lowalt.files.errors import InputError


@lru_cache(maxsize=16)
def colour_map(name: str) -> np.ndarray:
    """Return a matplotlib colour map as (256, 3) uint8 RGB.

    Raises: InputError where matplotlib has no map of that name.
    """
    import matplotlib

    if name not in matplotlib.colormaps:
        raise InputError(f"images.colour_map is {name!r}, expected a matplotlib name such as 'viridis' or 'gray'")
    table = matplotlib.colormaps[name](np.linspace(0, 1, 256), bytes=True)[:, :3].copy()
    table.setflags(write=False)
    return table


def paint(images: np.ndarray, palette: np.ndarray) -> np.ndarray:
    """Return RGB images: (..., H, W) uint8 index values and a (256, 3) palette -> (..., H, W, 3) uint8."""
    return np.take(palette, images, axis=0)
