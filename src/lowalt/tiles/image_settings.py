"""The settings of an image: size, amplitude scale and colour map (the configuration's `images` block)."""

from dataclasses import dataclass, field

import numpy as np

from lowalt.config.command import pick
from lowalt.files.errors import InputError
from lowalt.tiles.colour import colour_map
from lowalt.tiles.scale import Scale


@dataclass(frozen=True)
class Images:
    """`size` pixels a side of each image; values are scaled by `scale`, then coloured by `colour_map`."""

    size: int = 256
    scale: Scale = field(default_factory=Scale)
    colour_map: str = "viridis"

    @classmethod
    def from_settings(cls, block: dict) -> "Images":
        """Build from the `images` block: {size, scale, floor_db, gamma, colour_map}.

        Raises: InputError naming the key and value that is missing, unknown or out of range.
        """
        size, name, floor_db, gamma, colours = pick(block, "size", "scale", "floor_db", "gamma", "colour_map")
        if isinstance(size, bool) or not isinstance(size, int) or not 8 <= size <= 4096:
            raise InputError(f"images.size is {size!r}, expected an integer from 8 to 4096")
        colour_map(colours)
        return cls(size, Scale(name, floor_db, gamma), colours)

    @property
    def palette(self) -> np.ndarray:
        """The 256 colours of the index values, (256, 3) uint8."""
        return colour_map(self.colour_map)
