"""Gallery: all clouds in one picture, each in a panel of its own, coloured by part."""

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np

from lowalt.config.command import run
from lowalt.files.atomic import replacing
from lowalt.numerics.picture_layout import settle
from lowalt.targets import cyclist, quadruped
from lowalt.targets.cloud import Cloud, read
from lowalt.targets.skeleton import NODES, PARENTS

COLUMNS = 5
DPI = 110
DIRECTIONS = {
    "UAV": (180.0, 62.0),
    "Bird": (180.0, 80.0),
    "Vehicle": (90.0, 7.0),
    "Pedestrian": (75.0, 8.0),
}
"""The viewer's azimuth, from the front towards the right, and elevation (degrees).

They are chosen for each category.
"""

BODY_COLOUR = "#52525b"
PART_COLOURS = (
    "#d1495b",
    "#0077b6",
    "#e09f1f",
    "#2a9d8f",
    "#8e44ad",
    "#5f8a1f",
    "#e76f51",
    "#264653",
)
FAINT = 0.3
"""Opacity of points that face away from the viewer."""


def axes_of(kind: str) -> np.ndarray:
    """Return the rotation (3, 3) from body axes to right, up and toward the viewer.

    kind: the published class that the target is like.
    """
    azimuth, elevation = np.radians(DIRECTIONS[kind])
    toward = np.array(
        [
            np.sin(azimuth) * np.cos(elevation),
            np.cos(azimuth) * np.cos(elevation),
            np.sin(elevation),
        ]
    )
    right = np.array([-np.cos(azimuth), np.sin(azimuth), 0.0])
    return np.stack([right, np.cross(toward, right), toward])


def shown(cloud: Cloud) -> np.ndarray:
    """Return the points (L, 3) as (right, up, toward the viewer) in m.

    Those of a recording are in its first frame.
    """
    points = cloud.track[0] if len(cloud.track) else cloud.points
    seen = points @ axes_of(cloud.like).T
    return seen - [*((seen.max(0) + seen.min(0))[:2] / 2), 0]


def colours(cloud: Cloud) -> np.ndarray:
    """Return the RGBA colour of each point (L, 4).

    It is grey for the body, one of PART_COLOURS for each other part.

    Points that face away from the viewer are faint.
    """
    from matplotlib.colors import to_rgba

    names = [
        BODY_COLOUR if kind == "body" else PART_COLOURS[part % len(PART_COLOURS)]
        for part, kind in enumerate(cloud.kinds)
    ]
    result = np.array([to_rgba(name) for name in names])[cloud.part]
    toward = cloud.normals @ axes_of(cloud.like)[2]
    # A comparison with NaN is false, so points without a normal stay opaque.
    result[toward < -0.05, 3] = FAINT
    return result


def bones(names: tuple[str, ...]) -> list[tuple[int, int]]:
    """Return the pairs of nodes, by the names of a cloud's parts, that bones or bars join.

    There is none in a cloud whose parts are no nodes.
    """
    if names == NODES:
        return [(node, parent) for node, parent in enumerate(PARENTS) if parent >= 0]
    numbers = {name: number for number, name in enumerate(names)}
    result = []
    for chain in (*cyclist.CHAINS, *quadruped.CHAINS):
        if set(chain) <= set(numbers):
            result += [(numbers[start], numbers[end]) for start, end in pairwise(chain)]
    return result


def caption(cloud: Cloud) -> str:
    """Return a cloud's name, points, source and size, and how well a recording's cycle closes."""
    size = " x ".join(f"{value:.2g}" for value in np.ptp(cloud.points, axis=0))
    source = cloud.record["source"]
    gap = cloud.record.get("loop_mismatch_m")
    closes = ""
    if source == "mocap" and gap is not None:
        closes = f" (closes to {100 * gap:.2g} cm)"
    return f"{cloud.subtype}\n{len(cloud.points)} points, {source}{closes}, {size} m"


def _panel(axes, cloud: Cloud, aspect: float) -> None:
    """Draw a cloud that fills its panel, which is `aspect` times as high as wide."""
    seen = shown(cloud)
    width, height = np.ptp(seen, axis=0)[:2]
    half = max(width, height / aspect) / 2 * 1.06
    size = float(np.clip(1400 / len(cloud.points), 5, 22))
    # Bones between nodes show which nodes belong together.
    for bone in bones(cloud.names):
        axes.plot(*seen[list(bone), :2].T, color="#a1a1aa", linewidth=0.3 * size**0.5, zorder=0)
    order = np.argsort(seen[:, 2])  # The nearer points cover those behind.
    axes.scatter(*seen[order, :2].T, c=colours(cloud)[order], s=size, linewidths=0)
    axes.set(
        xlim=(-half, half),
        ylim=(-half * aspect, half * aspect),
        xticks=[],
        yticks=[],
        aspect="equal",
    )
    axes.set_title(caption(cloud), fontsize=7)
    for spine in axes.spines.values():
        spine.set_color("#d4d4d8")


def figure(clouds: list[Cloud]):
    """Return the matplotlib figure: every cloud fills its panel, in the order given."""
    from matplotlib.figure import Figure

    spans = np.array([np.ptp(shown(cloud), axis=0)[:2] for cloud in clouds])
    # Every panel of a row has the same shape, that of its tallest cloud.
    aspects = [
        float(np.clip((row[:, 1] / row[:, 0]).max(), 0.3, 1.3))
        for row in np.split(spans, range(COLUMNS, len(spans), COLUMNS))
    ]
    heights = [2.6 * aspect + 0.45 for aspect in aspects]
    result = Figure(figsize=(2.7 * COLUMNS, sum(heights)), dpi=DPI, layout="constrained")
    grid = result.add_gridspec(len(aspects), COLUMNS, height_ratios=heights)
    for number, cloud in enumerate(clouds):
        _panel(result.add_subplot(grid[divmod(number, COLUMNS)]), cloud, aspects[number // COLUMNS])
    return result


def main(arguments: list[str]) -> None:
    """Draw the gallery of the clouds given."""
    line = argparse.ArgumentParser(prog="python -m lowalt.targets.gallery", description=__doc__)
    line.add_argument("--clouds", required=True, nargs="+", type=Path, help="cloud files")
    line.add_argument("--out", required=True, type=Path, help="picture to write (.png)")
    options = line.parse_args(arguments)
    picture = figure([read(path) for path in options.clouds])
    settle(picture, DPI)
    with replacing(options.out) as temporary:
        # The file holds no version or date, so that equal clouds give equal bytes.
        picture.savefig(temporary, metadata={"Software": None})


if __name__ == "__main__":
    run(main)
