"""What a frozen baseline sees of signals and images, and how its network answers; copied next to
its file.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from lowalt.recognition.samples import Samples

EVALUATION = {"batch": 64, "threads": 1, "precision": "fp32", "mirror": True}


class Arrays(Samples):
    """Images or signals in memory, without any fact of their samples."""

    def __init__(self, values: np.ndarray) -> None:
        """values: (n, views, size, size) uint8 or (n, stations, symbols) complex64."""
        self.values = values
        self.size = values.shape[-1]
        self.facts = range(len(values))

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Return the samples `numbers`."""
        return self.values[numbers]


def by_station(
    function: Callable, frequencies_hz: tuple[float, ...], interval_s: float
) -> Callable:
    """Return the function from signals (n, stations, symbols) to the numbers of all stations side
    by side.

    function: of signals (B, N), the frequency (Hz) and the symbol interval (s), as
    `features.features`; frequencies_hz: of each station.
    """

    def told(signals: np.ndarray, images: np.ndarray) -> np.ndarray:
        """Numbers (n, stations * numbers) float32."""
        columns = []
        for station in range(signals.shape[1]):
            columns.append(function(signals[:, station], frequencies_hz[station], interval_s))
        return np.concatenate(columns, axis=1).astype(np.float32)

    return told


def embedding(weights: Path, colours: str) -> Callable:
    """Return the function from images to a frozen backbone's features; weights: its file; colours:
    a colour map.
    """
    from frozen import SCALE, embedded
    from imagenet_weights import BACKBONE

    from lowalt.recognition.recogniser import backbone

    def told(signals: np.ndarray, images: np.ndarray) -> np.ndarray:
        """Features (n, stations * F) float32."""
        model = backbone(BACKBONE, str(weights), SCALE * images.shape[-1]).eval()
        return embedded(images, model, colours).astype(np.float32).reshape(len(images), -1)

    return told


def network(model: Path, backbone: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return how a trained network on signals answers; model: its file; backbone: its name."""
    from signal_networks import builder

    from lowalt.recognition import runs
    from lowalt.recognition.inference import Machine

    trained = runs.load(model, build=builder(backbone))

    def answer(signals: np.ndarray) -> np.ndarray:
        """Probabilities (n, classes)."""
        return runs.answers(trained, Arrays(signals), EVALUATION, Machine.here("fp32"))

    return answer
