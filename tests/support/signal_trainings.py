"""Small trainings on slow-time signals and features: a cache that a few steps learn, its samples, a model's hits."""

import numpy as np

from lowalt.common.streams import stream
from lowalt.recognition import runs, slow_time


def write_signals(path, models=12):
    """Four classes that differ in how fast their phase turns; mirrored they are the same."""
    rng = stream(8, "turns")
    rows, values = [], []
    for label in range(4):
        for model in range(models):
            for snr in (3.0, np.inf):
                turn = 0.2 + 0.8 * label + rng.uniform(-0.1, 0.1)
                values.append(np.exp(1j * turn * np.arange(64) * np.ones((3, 1))) + 0.1 * rng.standard_normal((3, 64)))
                fold = ("val", "test", "train", "train", "train")[model % 5]
                rows.append((f"s{label}-{model}-{snr:g}", f"s{label}", model, snr, "seen", fold, label))
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    facts = dict(zip(slow_time.FACTS, columns, strict=False))
    facts |= {"range_m": np.full((len(rows), 3), np.nan), "aspect_rad": np.full((len(rows), 3), np.nan)}
    found = np.array(values, np.complex64)
    features = np.zeros((*found.shape[:2], len(slow_time.NAMES)), np.float32)
    features[..., 0] = np.abs(np.angle(found[..., 1:] * found[..., :-1].conj())).mean(-1)
    np.savez(path, signals=found, features=features, **facts)
    return path


def sources(path, kind, stations=(0, 1, 2)):
    """The samples for training and validation from a cache of signals and features."""
    return {
        part: slow_time.SlowTimeSamples([path], kind, list(stations), {("seen", fold)})
        for part, fold in (("train", "train"), ("validation", "val"))
    }


def share_right(model, path, kind, precision, out):
    """The share of test samples of a cache that a trained model recognises; its predictions are written to `out`."""
    asked = slow_time.SlowTimeSamples([path], kind, [0, 1, 2], {("seen", "test")})
    runs.evaluate(model, asked, {"batch": 8, "threads": 1, "precision": precision, "mirror": True}, out)
    shares = np.loadtxt(out, delimiter=",", skiprows=1, usecols=range(9, 13))
    return np.mean(shares.argmax(1) == asked.facts.label)
