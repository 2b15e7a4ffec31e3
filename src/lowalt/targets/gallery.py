"""Gallery: all clouds in one picture, one row a category at a fixed scale, coloured by part."""

import argparse
from pathlib import Path

import numpy as np

from lowalt.command import run
from lowalt.files import replacing
from lowalt.targets.cloud import CATEGORIES, Cloud, read

COLUMNS = 5
ELEVATION_DEG, AZIMUTH_DEG = 24.0, 35.0
BODY_COLOUR = "#6b7280"
PART_COLOURS = ("#d1495b", "#0077b6", "#edae49", "#2a9d8f", "#8e44ad", "#5f8a1f", "#e76f51", "#264653")


def view(points: np.ndarray) -> np.ndarray:
    """Return points (L, 3) as seen from the front right above, orthographic: right, up and toward the viewer (L, 3)."""
    azimuth, elevation = np.radians(AZIMUTH_DEG), np.radians(ELEVATION_DEG)
    toward = np.array([np.sin(azimuth) * np.cos(elevation), np.cos(azimuth) * np.cos(elevation), np.sin(elevation)])
    right = np.array([-np.cos(azimuth), np.sin(azimuth), 0.0])
    up = np.cross(toward, right)
    return points @ np.stack([right, up, toward], 1)


def shown(cloud: Cloud) -> np.ndarray:
    """Return the points as they are drawn (L, 3): a recording's first frame, otherwise the cloud itself."""
    return cloud.track[0] if len(cloud.track) else cloud.points


def colours(cloud: Cloud) -> list[str]:
    """Return one colour a point: grey for the body, the parts' colours in turn for the rest."""
    return [
        BODY_COLOUR if cloud.kinds[part] == "body" else PART_COLOURS[part % len(PART_COLOURS)] for part in cloud.part
    ]


def scale(clouds: list[Cloud]) -> float:
    """Return half the side (m) of the square that holds every cloud of a category as drawn."""
    return max(np.ptp(view(shown(cloud)), axis=0)[:2].max() for cloud in clouds) / 2 * 1.05


def draw(axes, cloud: Cloud, half: float, note: str) -> None:
    """Draw one cloud into matplotlib axes, `half` (m) from the middle to each edge, nearer points in front."""
    seen = view(shown(cloud))
    middle = (seen.max(0) + seen.min(0))[:2] / 2
    order = np.argsort(seen[:, 2])
    shade = np.array(colours(cloud))
    axes.scatter(*(seen[order, :2] - middle).T, c=shade[order], s=5.0, linewidths=0)
    axes.set(xlim=(-half, half), ylim=(-half, half), xticks=[], yticks=[], aspect="equal")
    axes.set_title(f"{cloud.subtype}\n{len(cloud.points)} points, {cloud.record['source']}{note}", fontsize=7)
    for spine in axes.spines.values():
        spine.set_color("#d4d4d8")


def figure(clouds: list[Cloud], zoom: bool = False):
    """Return the matplotlib figure: the clouds by category, in rows of five, one scale a category.

    With `zoom` each cloud fills its own panel, so that the small ones can be looked at.
    """
    from matplotlib.figure import Figure

    groups = [(name, [c for c in clouds if c.category == name]) for name in CATEGORIES]
    rows = [
        (name, members, members[start : start + COLUMNS])
        for name, members in groups
        for start in range(0, len(members), COLUMNS)
    ]
    result = Figure(figsize=(2.4 * COLUMNS, 2.7 * len(rows)), dpi=110, layout="constrained")
    panels = result.subplots(len(rows), COLUMNS, squeeze=False)
    for line, (name, members, row) in zip(panels, rows, strict=True):
        for axes, cloud in zip(line, row, strict=False):
            half = scale([cloud] if zoom else members)
            draw(axes, cloud, half, f", {2 * half:.2g} m")
        for axes in line[len(row) :]:
            axes.set_axis_off()
        line[0].set_ylabel(name, fontsize=9)
    return result


def main(arguments: list[str]) -> None:
    """Draw the gallery of the clouds given."""
    line = argparse.ArgumentParser(prog="python -m lowalt.targets.gallery", description=__doc__)
    line.add_argument("--clouds", required=True, nargs="+", type=Path, help="cloud files")
    line.add_argument("--out", required=True, type=Path, help="picture to write (.png)")
    line.add_argument(
        "--zoom", action="store_true", help="let every cloud fill its panel, instead of one scale a category"
    )
    given = line.parse_args(arguments)
    with replacing(given.out) as temporary:
        figure([read(path) for path in given.clouds], given.zoom).savefig(temporary)


if __name__ == "__main__":
    run(main)
