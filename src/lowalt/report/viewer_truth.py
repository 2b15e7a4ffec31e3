"""The truth of the viewer's samples: the folded radial speed of every point over time.

It is a picture with the axes of a spectrum.
"""

import colorsys
import io

import numpy as np
from PIL import Image

from lowalt.config.network import Network, Station
from lowalt.motion import positions
from lowalt.report.figures.style import embedded
from lowalt.scene.truth import STEP_S
from lowalt.scene.view import ways_by
from lowalt.targets.cloud import Cloud

COLUMNS = 200
ROWS = 100
"""Pixels of the picture."""
BODY = (138, 143, 152)
"""Colour (RGB) of points of a target's body, which stands out on white and on black."""
GOLDEN_DEG = 67
"""Angle between the hues of two parts that follow each other."""
LIGHTNESS = 0.5
SATURATION = 0.75
"""Of the colours of all parts but the body (0 to 1): they stand out on white and on black."""


def colours(cloud: Cloud) -> list[tuple[int, int, int]]:
    """Return the colour (RGB, 0 to 255) of each part of a cloud."""
    found = []
    for number, kind in enumerate(cloud.kinds):
        if kind == "body":
            found.append(BODY)
            continue
        hue = number * GOLDEN_DEG % 360 / 360
        red, green, blue = colorsys.hls_to_rgb(hue, LIGHTNESS, SATURATION)
        found.append((round(255 * red), round(255 * green), round(255 * blue)))
    return found


def speeds_mps(cloud: Cloud, row: dict, station: Station, times_s: np.ndarray) -> np.ndarray:
    """Return the radial speed (N, L) m/s of each point at times_s (N,), not folded.

    It is positive away from the station. Rotors turn far between two symbols, so the speed is taken
    over twice STEP_S.
    """
    before = ways_by(station, positions(cloud, row, times_s - STEP_S))
    after = ways_by(station, positions(cloud, row, times_s + STEP_S))
    # Ways are there and back.
    return (after - before) / (4 * STEP_S)


def truth(cloud: Cloud, row: dict, network: Network, points: np.ndarray) -> list[str]:
    """Return a picture per station of the folded radial speeds of `points` (numbers) of a cloud.

    Each is an embedded PNG without a background. Its columns are the instants of the look, its rows
    the speeds from the largest at the top down to its negative. A point has the colour of its part;
    the body is drawn over the others.
    """
    look_s = network.symbols * network.symbol_interval_s
    times_s = (np.arange(COLUMNS) + 0.5) / COLUMNS * look_s
    part = cloud.part[points]
    # The last colour written stays.
    order = points[np.argsort(-part, kind="stable")]
    # Index 0 is the background, which is transparent; part n has the index n + 1.
    palette = [0, 0, 0]
    for colour in colours(cloud):
        palette.extend(colour)
    pictures = []
    for station in network.stations:
        largest = network.largest_mps(station)
        shown = network.folded_mps(speeds_mps(cloud, row, station, times_s)[:, order], station)
        rows = np.clip((1 - shown / largest) / 2 * ROWS, 0, ROWS - 1).astype(int)
        indices = np.zeros((ROWS, COLUMNS), np.uint8)
        for number, point in enumerate(order):
            indices[rows[:, number], np.arange(COLUMNS)] = cloud.part[point] + 1
        picture = Image.fromarray(indices, "P")
        picture.putpalette(palette)
        stream = io.BytesIO()
        picture.save(stream, "png", optimize=True, transparency=0)
        pictures.append(embedded(stream.getvalue()))
    return pictures
