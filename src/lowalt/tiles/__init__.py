"""Images of spectra: index images, tiles of stations by spectra, palette PNG."""

from lowalt.tiles.image_settings import Images, colour_map, paint
from lowalt.tiles.png import decode, encode
from lowalt.tiles.render import Renderer, join, split
from lowalt.tiles.resample import resize, triangle
from lowalt.tiles.scale import Scale

__all__ = [
    "Images",
    "Renderer",
    "Scale",
    "colour_map",
    "decode",
    "encode",
    "join",
    "paint",
    "resize",
    "split",
    "triangle",
]
