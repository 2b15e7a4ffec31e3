"""A submission from any function: python examples/benchmark_predict.py [TRACK]."""

import sys

import numpy as np

from lowalt.extensions import benchmark

track = sys.argv[1] if len(sys.argv) > 1 else "unseen"
print(f"{track}: reading the data")
train = benchmark.load(track, "train")
means = [train.images[train.labels == label].mean(0) for label in range(len(train.classes))]


def predict(signals: np.ndarray, images: np.ndarray) -> np.ndarray:
    """Probabilities (n, classes) of signals (n, stations, 400) complex and images (n, stations * 3,
    24, 24) uint8.

    Here they fall off with the distance of an image to the mean image of each class.
    """
    away = np.stack([((images - mean) ** 2).mean((1, 2, 3)) for mean in means], axis=1)
    near = np.exp((away.min(1, keepdims=True) - away) / 100)
    return near / near.sum(1, keepdims=True)


test = benchmark.load(track, "test")
print(f"answering {len(test)} samples")
benchmark.write("predictions.csv", test, predict(test.signals, test.images))
print("predictions.csv: written")
