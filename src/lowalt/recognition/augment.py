"""Light augmentation of index images: one draw a sample, the same for all its views.

Every change keeps the class: a mirrored Doppler axis is the target turned by 180 degrees, a cyclic shift along it
another speed, a shift in time another start. No left-right flip: that would be time reversed.

Settings of this module, the block `recognition.augmentation` (zeros change nothing):
    mirror           probability of turning the Doppler axis around
    shift_doppler    largest cyclic shift along Doppler, share of the axis
    shift_time       largest cyclic shift along time, share of the axis
    contrast         largest |log2| of the exponent on the distance from the zero index
    mask_doppler     largest height of one band set to zero, share of the axis
    mask_time        largest width of one strip set to zero, share of the axis
    drop_view        probability that a view goes blank (never all views of a sample)
"""

import numpy as np

from lowalt.common.command import pick
from lowalt.common.errors import InputError
from lowalt.spectra.catalogue import NAMES, zero_index

KEYS = ("mirror", "shift_doppler", "shift_time", "contrast", "mask_doppler", "mask_time", "drop_view")


def check(block: dict) -> dict:
    """Return the block if every key is there and within 0..1.

    Raises: InputError naming the key and value.
    """
    for key, value in zip(KEYS, pick(block, *KEYS), strict=True):
        if not isinstance(value, (int, float)) or not 0 <= value <= 1:
            raise InputError(f"augmentation: {key} is {value!r}, expected a number in 0..1")
    return block


def _contrast(exponent: float, zero: int) -> np.ndarray:
    """Return the table (256,) uint8 that raises the distance from the zero index to a power; the ends stay."""
    index = np.arange(256) - zero
    reach = 255 - zero
    values = zero + np.sign(index) * reach * (np.abs(index) / reach) ** exponent
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def augment(images: np.ndarray, columns: list[int], block: dict, generator: np.random.Generator) -> np.ndarray:
    """Return changed copies of index images (samples, views, rows, columns) uint8; rows are Doppler, columns time.

    columns: numbers of their views (`Scheme.columns`). Equal generators give equal changes.
    """
    samples, views, rows, width = images.shape
    draws = generator.random((samples, 8))
    drops = generator.random((samples, views)) < block["drop_view"]
    zeros = [zero_index(NAMES[column % len(NAMES)]) for column in columns]
    result = np.empty_like(images)
    for number in range(samples):
        draw = draws[number]
        image = images[number]
        if draw[0] < block["mirror"]:
            image = image[:, ::-1]
        down = round((2 * draw[1] - 1) * block["shift_doppler"] * rows)
        right = round((2 * draw[2] - 1) * block["shift_time"] * width)
        image = np.roll(image, (down, right), (1, 2))
        if block["contrast"]:
            exponent = 2 ** ((2 * draw[3] - 1) * block["contrast"])
            tables = {zero: _contrast(exponent, zero) for zero in set(zeros)}
            image = np.stack([tables[zero][view] for zero, view in zip(zeros, image, strict=True)])
        band, strip = int(draw[4] * block["mask_doppler"] * rows), int(draw[6] * block["mask_time"] * width)
        top, left = int(draw[5] * (rows - band + 1)), int(draw[7] * (width - strip + 1))
        drop = drops[number] if not drops[number].all() else np.zeros(views, dtype=bool)
        for view, zero in enumerate(zeros):
            image[view, top : top + band] = zero
            image[view, :, left : left + strip] = zero
            if drop[view]:
                image[view] = zero
        result[number] = image
    return result
