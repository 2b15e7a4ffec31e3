"""Our clouds beside the authors' pictures, in the same view: `python pairs.py FOLDER OUT` writes one PNG a category.

FOLDER holds `pictures/`. Fixed parts and nodes are blue, moving ones red. A target is drawn by the axes of its picture,
a pedestrian at the moment of the cycle that is most like the picture. The factors by which our cars' bodies would have
to be scaled to have the authors' outline are printed, and what `pedestrians` measures of our pedestrians.
"""

import sys
from pathlib import Path

import numpy as np
from pedestrians import measured
from PIL import Image, ImageDraw
from read import LABELS, axes, dots
from scipy.optimize import least_squares

from lowalt.config.layers import load
from lowalt.targets.make import make
from lowalt.targets.records import records_of

ROOT = Path(__file__).parents[2]
CROPS = {"Vehicle": (395, 240, 920, 639), "Pedestrian": (450, 320, 820, 601)}
"""Part of the picture that is shown, in pixels: columns and rows of the first and of the last corner."""


def placed(cloud, category: str, base: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Return the cloud's points as the authors place them: birds with the nose on -y, cars on the ground z = 0,
    pedestrians by their root, at the moment when their dots lie nearest to the authors' dots (K, 2)."""
    if category == "Bird":
        return cloud.points * [-1, -1, 1]
    if category == "Pedestrian":
        track = cloud.track - cloud.track[:, :1]
        away = np.linalg.norm((base[0] + track @ base[1:])[:, :, None] - theirs, axis=3)
        return track[(away.min(1).mean(1) + away.min(2).mean(1)).argmin()]
    return cloud.points + np.array([0, 0, cloud.record["origin_height_m"] if category == "Vehicle" else 0])


def scaled(points: np.ndarray, base: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Return factors of x, y, z and shifts of y, z (m) that give our body's points (K, 3) the outline of their dots."""
    angles = np.radians(np.arange(0, 360, 6))
    ways = np.stack([np.cos(angles), np.sin(angles)], 1)
    reach = (ways @ theirs.T).max(1)

    def off(guess: np.ndarray) -> np.ndarray:
        """Pixels by which our outline reaches farther."""
        return (ways @ (base[0] + (points * guess[:3] + [0, *guess[3:]]) @ base[1:]).T).max(1) - reach

    return least_squares(off, [1, 1, 1, 0, 0]).x


def drawn(cloud, points: np.ndarray, base: np.ndarray, size: tuple[int, int]) -> Image.Image:
    """Return the cloud's picture of (width, height) by a projection (4, 2), its points (K, 3) as `placed`."""
    picture = Image.new("RGB", size, "white")
    pen = ImageDraw.Draw(picture)
    for place, part in zip(base[0] + points @ base[1:], cloud.part, strict=True):
        colour = (0, 114, 189) if cloud.kinds[part] in ("body", "node") else (220, 0, 0)
        pen.ellipse((*(place - 3), *(place + 3)), fill=colour)
    return picture


def main(folder: Path, out: Path) -> None:
    """Write the pairs of all targets."""
    records = records_of(load([ROOT / "config/default.yaml"], ROOT / "workflow/schemas/config.schema.yaml")["targets"])
    names = list(records)
    out.mkdir(parents=True, exist_ok=True)
    for number, category in enumerate(("UAV", "Bird", "Vehicle", "Pedestrian")):
        rows = [name for name in LABELS if name.startswith(category)]
        page = Image.new("RGB", (4 * 500, 5 * 380), "white")
        for place, name in enumerate(rows):
            theirs = Image.open(folder / "pictures" / f"Target40_{name}.jpg").convert("RGB")
            subtype = names[10 * number + int(name.split("_")[1]) - 1]
            base = axes(np.asarray(theirs), name)
            cloud = make(records[subtype], None, 1)
            outline = dots(np.asarray(theirs), category)["body"][0]
            points = placed(cloud, category, base, outline)
            if category == "Vehicle":
                body = points[[cloud.kinds[part] == "body" for part in cloud.part]]
                factors = scaled(body, base, outline)
                print(name, "width, length, height times", *factors[:3].round(2), "moved", *factors[3:].round(2))
            if category == "Pedestrian":
                figures = measured(cloud.track - cloud.track[:, :1])
                print(name, *(f"{what} {value:.3g} {unit};" for what, (value, unit) in figures.items()))
            ours = drawn(cloud, points, base, theirs.size)
            for side, picture in enumerate((theirs, ours)):
                shown = picture.crop(CROPS.get(category, (0, 0, *picture.size)))
                page.paste(shown.resize((500, 380)), (500 * (2 * (place % 2) + side), 380 * (place // 2)))
        page.save(out / f"{category}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
