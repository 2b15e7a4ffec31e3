"""The root of a covariance that depends on the lag alone, held against LAPACK's and against the matrix itself."""

import numpy as np
import pytest

from lowalt.effects.receiver import _toeplitz


def matrix(lags: np.ndarray) -> np.ndarray:
    place = np.arange(len(lags))
    return lags[abs(place[:, None] - place)]


@pytest.mark.parametrize("count", [1, 2, 3, 7, 64, 257])
@pytest.mark.parametrize("memory", [0.3, 5.0, 80.0])
def test_the_root_is_lapacks(count, memory):
    lag = np.arange(count)
    lags = np.exp(-lag / memory) * np.cos(0.3 * lag) + 0.5 * np.exp(-2.0 * lag)
    kept = lags.copy()
    found = _toeplitz.root(lags)
    np.testing.assert_array_equal(lags, kept)
    np.testing.assert_allclose(found, np.linalg.cholesky(matrix(lags)), rtol=0, atol=1e-13)
    assert (np.triu(found, 1) == 0.0).all()


def test_a_nearly_singular_covariance_is_the_product_of_its_root_with_itself():
    # A band of a hundredth of the sample rate over a floor 100 dB below it.
    lags = np.sinc(0.01 * np.arange(256))
    lags[0] *= 1.0 + 1e-10
    found = _toeplitz.root(lags)
    assert abs(found @ found.T - matrix(lags)).max() < 1e-13
