"""Small towns of boxes (x, y, width, depth, height) m, as arrays and as files of each kind that is
read.
"""

import json
from pathlib import Path

import numpy as np

from shown_meshes import ply as ply_bytes

ORIGIN = [11.575, 48.137]
BOXES = [(20.0, 5.0, 20.0, 30.0, 18.0), (-25.0, -20.0, 12.0, 24.0, 25.0), (-10.0, 40.0, 30.0, 14.0, 12.0),
         (50.0, -35.0, 26.0, 16.0, 33.0)]  # fmt: skip
SIDES = ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7))
"""Walls and roof of a box whose corners run around the foot and then around the roof."""


def corners_of(x, y, width, depth, height):
    """The eight corners (8, 3) of a box."""
    around = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    return np.array(
        [[x + a * width / 2, y + b * depth / 2, z] for z in (0.0, height) for a, b in around]
    )


def block(x, y, width, depth, height):
    """The ten triangles (10, 3, 3) of a box without a floor."""
    corners = corners_of(x, y, width, depth, height)
    return np.array(
        [corners[list(three)] for a, b, c, d in SIDES for three in ((a, b, c), (a, c, d))]
    )


def ply(path: Path, boxes) -> Path:
    """Write boxes as a PLY file of quadrilaterals."""
    vertices = np.concatenate([corners_of(*box) for box in boxes]).tolist()
    faces = [tuple(corner + 8 * k for corner in side) for k in range(len(boxes)) for side in SIDES]
    path.write_bytes(ply_bytes(vertices, faces, "ascii"))
    return path


def geojson(path: Path, boxes, heights: bool = True) -> Path:
    """Write boxes as footprints around ORIGIN, by the radii of curvature of the ellipsoid WGS84
    there.
    """
    major = 6378137.0
    flat = 1 / 298.257223563
    square = flat * (2 - flat)
    sine = np.sin(np.radians(ORIGIN[1]))
    east = major / np.sqrt(1 - square * sine**2) * np.cos(np.radians(ORIGIN[1]))
    north = major * (1 - square) / (1 - square * sine**2) ** 1.5
    features = []
    for box in boxes:
        ring = [
            [ORIGIN[0] + float(np.degrees(x / east)), ORIGIN[1] + float(np.degrees(y / north))]
            for x, y, _ in corners_of(*box)[[0, 1, 2, 3, 0]]
        ]
        properties = {"building": "yes", **({"height": f"{box[4]} m"} if heights else {})}
        geometry = {"type": "Polygon", "coordinates": [ring]}
        features.append({"type": "Feature", "properties": properties, "geometry": geometry})
    features.append({"type": "Feature", "properties": {"highway": "service"}, "geometry": None})
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def mitsuba(path: Path, boxes, name: str = "") -> Path:
    """Write boxes as a Mitsuba scene: unit cubes of one mesh, each scaled and moved; name: of the
    mesh instead.
    """
    ply(path.with_name("cube.ply"), [(0.0, 0.0, 1.0, 1.0, 1.0)])
    shapes = [
        f'<shape type="ply" id="b{k}"><string name="filename"'
        f' value="{name or "cube.ply"}"/><transform name="to_world"><scale x="{width}" y="{depth}"'
        f' z="{height}"/><translate x="{x}" y="{y}"/></transform><ref id="mat-itu_brick"'
        ' name="bsdf"/></shape>'
        for k, (x, y, width, depth, height) in enumerate(boxes)
    ]
    bsdf = (
        '<bsdf type="itu-radio-material" id="mat-itu_brick"><string name="type"'
        ' value="brick"/></bsdf>'
    )
    path.write_text(f'<scene version="2.1.0">{bsdf}{"".join(shapes)}<shape type="sphere"/></scene>')
    return path
