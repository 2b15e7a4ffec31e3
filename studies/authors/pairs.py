"""Our clouds beside the authors' pictures, in the same view: `python pairs.py FOLDER OUT` writes one PNG a category.

FOLDER holds `pictures/`. Fixed parts are blue, moving ones red. A craft or bird is drawn by the axes of its picture.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw
from read import LABELS, axes

from lowalt.config.layers import load
from lowalt.targets.make import make
from lowalt.targets.records import records_of

ROOT = Path(__file__).parents[2]


def drawn(cloud, base: np.ndarray, size: tuple[int, int], flip: bool) -> Image.Image:
    """Return the cloud's picture of (width, height) by a projection (4, 2); flip: the nose on -y."""
    picture = Image.new("RGB", size, "white")
    pen = ImageDraw.Draw(picture)
    points = cloud.points * ([-1, -1, 1] if flip else [1, 1, 1])
    for place, part in zip(base[0] + points @ base[1:], cloud.part, strict=True):
        colour = (0, 114, 189) if cloud.kinds[part] == "body" else (220, 0, 0)
        pen.ellipse((*(place - 3), *(place + 3)), fill=colour)
    return picture


def main(folder: Path, out: Path) -> None:
    """Write the pairs of all targets whose axes are read."""
    records = records_of(load([ROOT / "config/default.yaml"], ROOT / "workflow/schemas/config.schema.yaml")["targets"])
    names = list(records)
    out.mkdir(parents=True, exist_ok=True)
    for category in ("UAV", "Bird"):
        rows = [name for name in LABELS if name.startswith(category)]
        page = Image.new("RGB", (4 * 500, 5 * 380), "white")
        for place, name in enumerate(rows):
            theirs = Image.open(folder / "pictures" / f"Target40_{name}.jpg").convert("RGB")
            subtype = names[(10 if category == "Bird" else 0) + int(name.split("_")[1]) - 1]
            base = axes(np.asarray(theirs), name)
            ours = drawn(make(records[subtype], None, 1), base, theirs.size, category == "Bird")
            for side, picture in enumerate((theirs, ours)):
                page.paste(picture.resize((500, 380)), (500 * (2 * (place % 2) + side), 380 * (place // 2)))
        page.save(out / f"{category}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
