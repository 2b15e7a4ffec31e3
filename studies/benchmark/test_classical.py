"""Least squares of the study's linear classifier are scikit-learn's."""

import classical
import numpy as np
from sklearn.linear_model import Ridge


def test_least_squares_are_those_of_scikit_learn():
    generator = np.random.default_rng(0)
    told = generator.normal(3, 2, (60, 9))
    asked = generator.normal(3, 2, (7, 9))
    labels = (told[:, 0] > 4).astype(int) + (told[:, 1] > 5)
    mean = told.mean(0)
    scale = told.std(0)
    scores = list(classical.MAKERS["ridge"](told, labels, {"penalties": (1.0, 30.0)}, 0))
    for penalty, found in zip((1.0, 30.0), scores, strict=True):
        expected = (
            Ridge(alpha=penalty)
            .fit((told - mean) / scale, np.eye(3)[labels])
            .predict((asked - mean) / scale)
        )
        np.testing.assert_allclose(found(asked), expected, rtol=1e-9)
