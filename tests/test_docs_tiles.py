"""The picture of the first page: the clean tile of each class out of a data set, and four of them
on one page.
"""

import io

import numpy as np
import pytest
import tiles_picture
from PIL import Image

from dataset import build
from lowalt.files.errors import InputError
from lowalt.report.figures.tile_axes import example_tiles
from lowalt.shards import ShardSet


def test_the_tile_of_a_class_is_that_of_its_first_motion_model_without_noise(tmp_path):
    shards = ShardSet(build(tmp_path / "set", "signal") / "index.json", folds=["test"])
    found = example_tiles(shards)
    records = [shards.record(number) for number in range(len(shards))]
    clean = np.flatnonzero(np.isinf(shards.snrs_db))
    assert 0 < len(clean) < len(shards)
    for (words, png), name in zip(
        found, ("UAV: DJI Mavic 3", "Bird: Crow", "Vehicle: Model Y"), strict=True
    ):
        number = min(
            (i for i in clean if name.endswith(records[i]["subtype"])),
            key=lambda i: records[i]["model"],
        )
        assert words == f"{name}, motion model {records[number]['model']}, no noise"
        shown = Image.open(io.BytesIO(png))
        assert (np.asarray(shown) == shards.tile(int(number))).all()
        assert (np.array(shown.getpalette()).reshape(-1, 3) == shards.palette).all()


def test_the_page_has_four_tiles_at_half_size_and_a_gap_between_them():
    colours = [(250, 0, 0), (0, 250, 0), (0, 0, 250), (120, 120, 0)]
    tiles = []
    for colour in colours:
        tiles.append(io.BytesIO())
        Image.new("RGB", (40, 40), colour).save(tiles[-1], "PNG")
    page = np.asarray(tiles_picture.cover([one.getvalue() for one in tiles]).convert("RGB")).astype(
        int
    )
    assert page.shape == (52, 52, 3)
    for place, colour in zip(((0, 0), (0, 32), (32, 0), (32, 32)), colours, strict=True):
        assert abs(page[place[0] : place[0] + 20, place[1] : place[1] + 20] - colour).max() <= 4
    assert (page[20:32] >= 251).all() and (page[:, 20:32] >= 251).all()
    with pytest.raises(InputError, match="3 tiles, expected one of each"):
        tiles_picture.cover([one.getvalue() for one in tiles[:3]])
