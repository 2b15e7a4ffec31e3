"""Windows of a recording, or of a simulated radar, as samples for a network: their images and their facts."""

import numpy as np

from lowalt.extensions.recordings.twin import Twin
from lowalt.recognition.samples import Facts, Samples
from lowalt.tiles.image_settings import Images
from lowalt.tiles.render import Renderer, split
from lowalt.tiles.resample import resize


class Windows(Samples):
    """Samples in memory, as a trainer reads them: images (n, 3, size, size) uint8, and the facts of each."""

    def __init__(self, images: np.ndarray, facts: Facts) -> None:
        """Keep the images and their facts."""
        self.images, self.facts, self.size = images, facts, images.shape[-1]

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Index images (len(numbers), 3, size, size) uint8 of the samples `numbers`."""
        return self.images[numbers]


def rendered(intervals: np.ndarray, twin: Twin, images: Images, size: int) -> np.ndarray:
    """Return the images (n, 3, size, size) uint8 of coherent intervals (n, symbols), at a radar's own carrier."""
    renderer = Renderer(twin.network(intervals.shape[1]), twin.spectra(), images)
    result = np.empty((len(intervals), len(renderer.spectra), size, size), np.uint8)
    for number, interval in enumerate(intervals):
        result[number] = resize(split(renderer.tile(interval[None].astype(np.complex64)), len(renderer.spectra)), size)
    return result


def facts(labels: np.ndarray, names: list[str], models: np.ndarray, snr: np.ndarray, fold: str) -> Facts:
    """Return the facts of n samples.

    labels (n,); names: subtypes or file names; models (n,): their numbers; snr (n,): number of the receiver.
    """
    count = len(labels)
    unknown = np.full((count, 1), np.nan)
    keys = [f"{name}-{model:06d}-{int(number)}" for name, model, number in zip(names, models, snr, strict=True)]
    return Facts(
        key=np.array(keys),
        subtype=np.array(names), model=models, snr_db=snr, group=np.full(count, "seen"), fold=np.full(count, fold),
        label=labels, range_m=unknown, aspect_rad=unknown,
    )  # fmt: skip
