"""Augmentation: one draw for all views of a sample, along Doppler but never turned in time, blank
at the zero index.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.numerics.streams import stream
from lowalt.recognition.augment import augment
from lowalt.spectra import NAMES

KEYS = (
    "mirror",
    "shift_doppler",
    "shift_time",
    "contrast",
    "mask_doppler",
    "mask_time",
    "drop_view",
)


def block(**changes):
    return {**dict.fromkeys(KEYS, 0.0), **changes}


def test_augmentation_without_strength_changes_nothing_and_never_its_input():
    images = stream(3, "images").integers(0, 256, (4, 9, 12, 12), dtype=np.uint8)
    before = images.copy()
    assert (augment(images, [0, 1, 2, 4, 5, 6, 8, 9, 10], block(), stream(1, "a")) == images).all()
    strong = block(
        mirror=0.5,
        shift_doppler=0.3,
        shift_time=0.3,
        contrast=1,
        mask_time=0.5,
        mask_doppler=0.5,
        drop_view=0.5,
    )
    changed = augment(images, [0, 1, 2, 4, 5, 6, 8, 9, 10], strong, stream(1, "a"))
    assert (images == before).all()
    assert (changed == augment(images, [0, 1, 2, 4, 5, 6, 8, 9, 10], strong, stream(1, "a"))).all()
    assert (changed != images).any()


@pytest.mark.parametrize(("key", "axis", "masked"), [("mask_doppler", 0, 9), ("mask_time", 1, 4)])
def test_the_last_place_of_the_widest_mask_is_the_edge(key, axis, masked):
    largest = SimpleNamespace(random=lambda shape: np.full(shape, np.nextafter(1, 0)))
    blank = (
        augment(np.full((1, 1, 20, 10), 77, np.uint8), [0], block(**{key: 0.5}), largest)[0, 0] == 0
    )
    size = (20, 10)[axis]
    assert np.flatnonzero(blank.all(1 - axis)).tolist() == list(range(size - masked, size))


def slow(image, draw, strengths, zeros, dropped):
    """The changed views of one sample, a pixel at a time, from eight draws in 0..1."""
    views, rows, columns = image.shape
    down = round((2 * draw[1] - 1) * strengths["shift_doppler"] * rows)
    right = round((2 * draw[2] - 1) * strengths["shift_time"] * columns)
    exponent = 2 ** ((2 * draw[3] - 1) * strengths["contrast"])
    band = int(draw[4] * strengths["mask_doppler"] * rows)
    strip = int(draw[6] * strengths["mask_time"] * columns)
    top = int(draw[5] * (rows - band + 1))
    left = int(draw[7] * (columns - strip + 1))
    found = np.empty_like(image)
    for view, row, column in np.ndindex(views, rows, columns):
        from_row = (row - down) % rows
        zero = zeros[view]
        if draw[0] < strengths["mirror"]:
            from_row = rows - 1 - from_row
        away = int(image[view, from_row, (column - right) % columns]) - zero
        value = zero + np.sign(away) * (255 - zero) * (abs(away) / (255 - zero)) ** exponent
        blank = (
            top <= row < top + band
            or left <= column < left + strip
            or (dropped[view] and not all(dropped))
        )
        found[view, row, column] = zero if blank else min(max(round(value), 0), 255)
    return found


def test_each_of_the_eight_draws_decides_one_change():
    """Views are VRP, TRP and VT of a station, whose zero is 0, 0 and 128, and the VT of the next
    one.
    """
    images = stream(7, "images").integers(0, 256, (24, 4, 7, 12), dtype=np.uint8)
    strong = {
        "mirror": 0.4,
        "shift_doppler": 0.3,
        "shift_time": 0.4,
        "contrast": 0.8,
        "mask_doppler": 0.6,
        "mask_time": 0.5,
        "drop_view": 0.7,
    }
    numbers = stream(8, "draws")
    draws = numbers.random((24, 8))
    drops = numbers.random((24, 4))
    draws[0, 0], draws[1, 0], drops[2] = 0.4, np.nextafter(0.4, 0), 0.1
    drops[3, 1] = 0.7
    made = iter((draws, drops))
    found = augment(
        images, [0, 1, 2, len(NAMES) + 2], strong, SimpleNamespace(random=lambda shape: next(made))
    )
    for image, changed, draw, drop in zip(images, found, draws, drops, strict=True):
        assert (changed == slow(image, draw, strong, (0, 0, 128, 128), drop < 0.7)).all()
