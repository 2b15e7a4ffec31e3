"""Compiled loops of phase noise and the lags its covariance follows from, against sums written out."""

import mpmath
import numpy as np
import pytest

from lowalt.effects.receiver import _oscillator, _oscillator_grid
from lowalt.effects.receiver._oscillator_loops import halved_lines, range_correlated, weighed_lines


def test_lines_are_weighed_by_the_delay_and_others_are_zero():
    drawn, amplitude = np.random.default_rng(1).standard_normal((2, 30)), np.linspace(1.0, 2.0, 30)
    got = np.full((5, 2, 8), np.nan)
    weighed_lines(drawn, amplitude, *_oscillator._delays(0.3, 5, 8), got)
    expected = drawn * amplitude * 2 * abs(np.sin(0.3 * np.arange(1, 31)))
    found = got.transpose(1, 0, 2).reshape(2, 40)
    np.testing.assert_allclose(found[:, 1:31], expected, rtol=1e-12)
    assert (found[:, [0, *range(31, 40)]] == 0).all()
    weighed_lines(drawn, amplitude, *_oscillator._delays(None, 5, 8), got)
    np.testing.assert_array_equal(got.transpose(1, 0, 2).reshape(2, 40)[:, 1:31], drawn * amplitude)


@pytest.mark.parametrize("count", [4, 5])
def test_half_the_lines_make_the_same_real_sequences(count):
    """Against the real part of the whole sum, for nodes on both sides of the middle, with and without one in it."""
    turns, later = 12, np.arange(count // 2 + count % 2) + 0.5 * (1 - count % 2)
    lines, angle = np.random.default_rng(2).standard_normal((turns, 2)) @ [1, 1j], 0.1 * np.arange(turns)
    cosines = np.stack([np.cos(later[:, None] * angle), np.sin(later[:, None] * angle)])
    folded = np.zeros((count, 2, turns))
    # Every 12th line at the angle 0.7: cosines for all nodes, then sines for those outside the middle.
    weight = np.concatenate([np.cos(0.7 * later), np.sin(0.7 * later[count % 2 :])])
    folded[:, 0], folded[:, 1] = weight[:, None] * lines.real, weight[:, None] * lines.imag
    halves = np.empty((count, turns // 2 + 1), np.complex128)
    halved_lines(folded, cosines, halves)
    found = np.fft.irfft(halves, turns)
    whole = [np.cos(node * (0.7 + angle)) * lines for node in later]
    whole += [1j * np.sin(node * (0.7 + angle)) * lines for node in later[count % 2 :]]
    np.testing.assert_allclose(found, np.fft.ifft(whole, axis=1).real, atol=1e-15)


@pytest.mark.parametrize("delay_s", [0.0, 1e-10, 2e-6, 1e-3])
def test_range_correlation_is_the_mean_over_each_nodes_width(delay_s):
    frequency, width = np.geomspace(1e3, 1e6, 40), np.geomspace(30.0, 1e5, 40)
    found = np.empty(40)
    range_correlated(np.full(40, 3.0), frequency, width, delay_s, found)
    with mpmath.workdps(40):
        for value, f, w in zip(found, frequency, width, strict=True):
            mean = 2 - 2 * mpmath.cos(2 * mpmath.pi * f * delay_s) * mpmath.sincpi(mpmath.mpf(w) * delay_s)
            assert value == pytest.approx(float(3 * mean), rel=1e-13, abs=1e-15 if delay_s > 1e-6 else 0)


@pytest.mark.parametrize("subcarriers", [9, 256])
def test_cosines_of_all_lags_come_from_a_few_to_rounding(subcarriers):
    at = _oscillator_grid.grid(12, subcarriers, 2.5e-3, 1 / (subcarriers * 120e3))
    assert at.low_cosine.shape[1] == (9 if subcarriers == 9 else 64)
    expected = np.cos(2 * np.pi * np.outer(at.low_hz, np.arange(subcarriers)) / (subcarriers * 120e3))
    np.testing.assert_allclose(at.low_cosine @ at.low_blend, expected, rtol=0, atol=3e-14)
