"""The settings of an image (the configuration's `images` block).

They are size, amplitude scale and colour map.
"""

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from lowalt.config.command import pick
from lowalt.files.errors import InputError
from lowalt.tiles.scale import Scale


@lru_cache(maxsize=16)
def colour_map(name: str) -> np.ndarray:
    """Return a matplotlib colour map as (256, 3) uint8 RGB.

    Raises: InputError where matplotlib has no map of that name.
    """
    import matplotlib

    if name not in matplotlib.colormaps:
        raise InputError(
            f"images.colour_map is {name!r}, expected a matplotlib name such as 'viridis' or 'gray'"
        )
    colours = matplotlib.colormaps[name](np.linspace(0, 1, 256), bytes=True)
    table = colours[:, :3].copy()
    table.setflags(write=False)
    return table


def paint(images: np.ndarray, palette: np.ndarray) -> np.ndarray:
    """Return RGB images (..., H, W, 3) uint8 of index values (..., H, W) and a palette (256, 3)."""
    return np.take(palette, images, axis=0)


@dataclass(frozen=True)
class Images:
    """The settings of an image: its pixels per side, its amplitude scale and its colour map."""

    size: int = 256
    scale: Scale = field(default_factory=Scale)
    colour_map: str = "viridis"

    @classmethod
    def from_settings(cls, block: dict) -> "Images":
        """Build from the `images` block: {size, scale, floor_db, gamma, colour_map}.

        Raises: InputError naming the key and value that is missing, unknown or out of range.
        """
        size, name, floor_db, gamma, colours = pick(
            block, "size", "scale", "floor_db", "gamma", "colour_map"
        )
        if isinstance(size, bool) or not isinstance(size, int) or not 8 <= size <= 4096:
            raise InputError(f"images.size is {size!r}, expected an integer from 8 to 4096")
        colour_map(colours)
        return cls(size, Scale(name, floor_db, gamma), colours)

    @property
    def palette(self) -> np.ndarray:
        """The 256 colours of the index values, (256, 3) uint8."""
        return colour_map(self.colour_map)
