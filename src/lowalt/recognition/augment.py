"""Light augmentation of index images: one draw per sample, the same for all its views.

Every change keeps the class: a mirrored Doppler axis is the target turned by 180 degrees, a cyclic
shift along it another speed, a shift in time another start. No left-right flip: that would be time
reversed.

Settings are the block `recognition.augmentation` of workflow/schemas/config.schema.yaml; zeros
change nothing.
"""

import numpy as np

from lowalt.spectra.catalogue import NAMES, zero_index


def _contrast(exponents: np.ndarray, zero: int) -> np.ndarray:
    """Return tables (samples, 256) uint8 that raise the distance from the zero index to powers.

    exponents: the powers, (samples,). The ends stay.
    """
    index = np.arange(256) - zero
    reach = 255 - zero
    values = zero + np.sign(index) * reach * (np.abs(index) / reach) ** exponents[:, None]
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def _moved(
    images: np.ndarray, mirror: np.ndarray, down: np.ndarray, right: np.ndarray
) -> np.ndarray:
    """Return images (samples, views, rows, columns) mirrored along rows and shifted cyclically.

    mirror: (samples,), which to mirror; down, right: shifts (samples,) in pixels.
    """
    samples, views, rows, columns = images.shape
    row = (np.arange(rows) - down[:, None]) % rows
    column = (np.arange(columns) - right[:, None]) % columns
    row = np.where(mirror[:, None], rows - 1 - row, row)
    pixel = (row[:, :, None] * columns + column[:, None]).reshape(samples, -1)
    result = np.empty((samples, views, rows * columns), images.dtype)
    for image, source, moved in zip(images.reshape(result.shape), pixel, result, strict=True):
        # All pixels are in range. With this mode numpy does not check each of them.
        image.take(source, axis=1, out=moved, mode="wrap")
    return result.reshape(images.shape)


def augment(
    images: np.ndarray, columns: list[int], block: dict, generator: np.random.Generator
) -> np.ndarray:
    """Return changed copies of index images (samples, views, rows, columns) uint8.

    Rows are Doppler, columns time.
    columns: numbers of their views (`Scheme.columns`). Equal generators give equal changes.
    """
    samples, views, rows, width = images.shape
    draws = generator.random((samples, 8))
    drops = generator.random((samples, views)) < block["drop_view"]
    zeros = [zero_index(NAMES[column % len(NAMES)]) for column in columns]
    down = np.rint((2 * draws[:, 1] - 1) * block["shift_doppler"] * rows).astype(np.int64)
    right = np.rint((2 * draws[:, 2] - 1) * block["shift_time"] * width).astype(np.int64)
    result = _moved(images, draws[:, 0] < block["mirror"], down, right)
    if block["contrast"]:
        exponents = 2 ** ((2 * draws[:, 3] - 1) * block["contrast"])
        tables = {zero: _contrast(exponents, zero) for zero in set(zeros)}
        for number, image in enumerate(result):
            of_zero = {zero: table[number].tobytes() for zero, table in tables.items()}
            # Faster than the table indexed by the image, for which numpy first widens the image to
            # 64 bits.
            changed = b"".join(
                view.tobytes().translate(of_zero[zero])
                for zero, view in zip(zeros, image, strict=True)
            )
            image[:] = np.frombuffer(changed, np.uint8).reshape(image.shape)
    for number, image in enumerate(result):
        of_band, of_top, of_strip, of_left = draws[number][4:8]
        band = int(of_band * block["mask_doppler"] * rows)
        strip = int(of_strip * block["mask_time"] * width)
        top = int(of_top * (rows - band + 1))
        left = int(of_left * (width - strip + 1))
        drop = drops[number]
        if drop.all():
            drop = np.zeros(views, dtype=bool)
        if not (band or strip or drop.any()):
            continue
        for view, zero in enumerate(zeros):
            image[view, top : top + band] = zero
            image[view, :, left : left + strip] = zero
            if drop[view]:
                image[view] = zero
    return result
