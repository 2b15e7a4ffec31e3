"""A submission of features and an estimator: python examples/benchmark_features.py [TRACK]."""

import sys

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier

from lowalt.extensions import benchmark


def features(signals: np.ndarray) -> np.ndarray:
    """Shares of the power in 16 Doppler bands of each station, (n, stations * 16), the strongest
    line in the middle.
    """
    power = np.abs(np.fft.fft(signals)) ** 2
    rows = np.arange(power.shape[-1]) + power.argmax(-1)[..., None] - power.shape[-1] // 2
    centred = np.take_along_axis(power, rows % power.shape[-1], -1)
    bands = centred.reshape(*power.shape[:2], 16, -1).sum(-1)
    return np.log(bands / bands.sum(-1, keepdims=True)).reshape(len(signals), -1)


track = sys.argv[1] if len(sys.argv) > 1 else "unseen"
print(f"{track}: reading the data")
train = benchmark.load(track, "train")
test = benchmark.load(track, "test")
model = HistGradientBoostingClassifier(max_iter=50, random_state=0, verbose=1)
model.fit(features(train.signals), train.labels)
benchmark.write("predictions.csv", test, model.predict_proba(features(test.signals)))
score = f"lowalt benchmark score predictions.csv --track {track}"
print(f"predictions.csv: written; score it with `{score}`")
