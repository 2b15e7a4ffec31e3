"""A choice for subtypes that nothing trained on: python examples/benchmark_choose.py."""

import numpy as np
from sklearn.linear_model import LogisticRegression

from lowalt.extensions import benchmark


def features(signals: np.ndarray) -> np.ndarray:
    """The sorted Doppler spectrum of each station at four ranks in dB, (n, stations * 4)."""
    power = np.sort(np.abs(np.fft.fft(signals)) ** 2)[..., ::-1]
    return 10 * np.log10(power[..., [2, 9, 29, 99]] / power[..., :1]).reshape(len(signals), -1)


track = "unseen"
right: dict[float, list[float]] = {0.001: [], 1.0: []}
for split in benchmark.INNER:
    train = benchmark.load(track, "train", split=split)
    held_out = benchmark.load(track, "validation", split=split)
    for strength, found in right.items():
        model = LogisticRegression(C=strength, max_iter=300).fit(
            features(train.signals), train.labels
        )
        found.append(model.score(features(held_out.signals), held_out.labels))
    print(f"{split}: {sorted(set(held_out.facts.subtype.tolist()))} held out")
for strength, found in right.items():
    print(f"C = {strength}: {100 * np.mean(found):.1f} % of the subtypes that did not train")
