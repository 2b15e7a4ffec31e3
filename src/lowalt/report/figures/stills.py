"""The page's two pictures of points as files next to it: clouds and motion, each as SVG and as a table.

The picture of clouds has too many points to be drawn one by one, so its SVG holds the picture that the targets stage
made; its table has every point.
"""

import struct
from pathlib import Path

import numpy as np

from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import write_csv
from lowalt.report.figures.motion_strip import strip_figure, strip_rows
from lowalt.report.figures.style import embedded, svg
from lowalt.targets.cloud import Cloud


def wrapped(png: bytes) -> str:
    """Return an SVG of a PNG picture's own size that holds it."""
    width, height = struct.unpack(">II", png[16:24])
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
        f'<image width="{width}" height="{height}" href="{embedded(png)}"/></svg>\n'
    )


def cloud_points(clouds: list[Cloud]) -> list[dict]:
    """Return one row a point of every cloud: subtype, category, part, x, y, z (m, to 0.1 mm)."""
    rows = []
    for cloud in clouds:
        parts = cloud.part.tolist() if len(cloud.part) == len(cloud.points) else [0] * len(cloud.points)
        for part, point in zip(parts, np.round(cloud.points, 4).tolist(), strict=True):
            facts = {"subtype": cloud.subtype, "category": cloud.category, "part": part}
            rows.append(facts | dict(zip(("x_m", "y_m", "z_m"), point, strict=True)))
    return rows


def write_stills(folder: Path, clouds: list[Cloud], gallery: bytes, motion: list[dict]) -> None:
    """Write clouds.svg, clouds.csv, motion.svg and motion.csv; equal inputs give equal files.

    gallery: the picture of all clouds (PNG); motion: rows of the motion table whose first of each class is drawn.
    """
    texts = {"clouds": wrapped(gallery), "motion": svg(strip_figure(clouds, motion))}
    tables = {"clouds": cloud_points(clouds), "motion": strip_rows(clouds, motion)}
    for name, text in texts.items():
        write_csv(folder / f"{name}.csv", list(tables[name][0]), tables[name])
        with replacing(folder / f"{name}.svg") as temporary:
            temporary.write_text(text)
