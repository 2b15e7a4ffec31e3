"""Roots of a covariance that depends on the lag alone, held against the matrix itself and against LAPACK's."""

import numpy as np
import pytest

from lowalt.effects.receiver import _toeplitz


def matrix(lags: np.ndarray) -> np.ndarray:
    place = np.arange(len(lags))
    return lags[abs(place[:, None] - place)]


def roots(lags: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    even, odd = (np.full((size, size), np.nan) for size in (len(lags) - len(lags) // 2, len(lags) // 2))
    _toeplitz.roots(lags, even, odd)
    return even, odd


def covariance(even: np.ndarray, odd: np.ndarray) -> np.ndarray:
    """Covariance of the samples that independent normal numbers times both roots are the parts of."""
    rows = [
        _toeplitz.joined(even, np.zeros((len(even), len(odd)))),
        _toeplitz.joined(np.zeros((len(odd), len(even))), odd),
    ]
    return np.concatenate(rows).T @ np.concatenate(rows)


@pytest.mark.parametrize("count", [1, 2, 3, 7, 64, 257])
@pytest.mark.parametrize("memory", [0.3, 5.0, 80.0])
def test_the_roots_are_lapacks_of_both_parts_covariances(count, memory):
    lag = np.arange(count)
    lags = np.exp(-lag / memory) * np.cos(0.3 * lag) + 0.5 * np.exp(-2.0 * lag)
    kept = lags.copy()
    found = roots(lags)
    np.testing.assert_array_equal(lags, kept)
    for root, part in zip(found, _toeplitz.parts(np.eye(count)), strict=True):
        expected = np.linalg.cholesky(part.T @ matrix(lags) @ part) if len(root) else root
        np.testing.assert_allclose(root.T, expected, rtol=0, atol=1e-13)
        assert (np.tril(root, -1) == 0.0).all()
    np.testing.assert_allclose(covariance(*found), matrix(lags), rtol=0, atol=1e-13)


def test_a_nearly_singular_covariance_is_the_product_of_its_roots_with_themselves():
    # A band of a hundredth of the sample rate over a floor 100 dB below it.
    lags = np.sinc(0.01 * np.arange(256))
    lags[0] *= 1.0 + 1e-10
    assert abs(covariance(*roots(lags)) - matrix(lags)).max() < 1e-13


@pytest.mark.parametrize("count", [1, 2, 5, 8])
def test_joined_parts_are_the_samples(count):
    samples = np.random.default_rng(1).standard_normal((3, count))
    even, odd = _toeplitz.parts(samples)
    assert even.shape == (3, count - count // 2) and odd.shape == (3, count // 2)
    np.testing.assert_allclose(_toeplitz.joined(even, odd), samples, rtol=0, atol=1e-15)
    straight = _toeplitz.parts(np.arange(count)[None] - (count - 1) / 2)
    assert not straight[0].any() and (straight[1] > 0).all()
