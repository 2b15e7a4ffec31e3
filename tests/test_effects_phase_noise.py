"""Phase noise: covariances, lines and leakage against integrals of the spectrum that the scene asks for."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from effects_frames import checked, frame, network, received
from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.effects.receiver import (
    _oscillator,
    _toeplitz,
    phase_noise,
)

FLAT = ((1.0, -90.0),)
STEEP = ((10.0, -30.0), (1e3, -80.0), (1e5, -100.0), (1e6, -125.0), (1e7, -130.0))
LOOK = (400, 256, 2.5e-3, 1 / (256 * 120e3))


def integral(points, weight, low=1e-2, high=LOOK[1] * 60e3, count=400_000) -> float:
    """Slow truth: the two-sided integral of the density times weight(f), by trapezoids in log f."""
    f = np.geomspace(low, high, count)
    values = _oscillator.density(points, f) * weight(f) * f
    return 2 * float(np.sum((values[1:] + values[:-1]) / 2) * np.log(f[1] / f[0]))


def drawn(points, delay_s=None, look=LOOK, seeds=40):
    return np.stack([_oscillator.phase(points, look, delay_s, np.random.default_rng(s)) for s in range(seeds)])


def test_density_goes_through_its_points():
    f = np.array([1.0, 10.0, 100.0, 1e4, 1e7, 1e9])
    level = 10 * np.log10(_oscillator.density(STEEP, f))
    np.testing.assert_allclose(level, [-30, -30, -55, -90, -130, -130], atol=1e-9)


def test_the_default_spectrum_is_that_of_the_3gpp_model():
    """TR 38.803, Table 6.1.10-1 (29.55 GHz): level, zeros and poles (Hz) with their powers; 20 log10 to 4.9 GHz."""
    f = np.geomspace(1, 15e6, 2000)
    level = 32 + 20 * math.log10(4.9 / 29.55)
    for hertz, power in ((3e3, 2.37), (550e3, 2.7), (280e6, 2.53)):
        level = level + 10 * np.log10(1 + (f / hertz) ** power)
    for hertz, power in ((1.0, 3.3), (1.6e6, 3.3), (30e6, 1.0)):
        level = level - 10 * np.log10(1 + (f / hertz) ** power)
    points = tuple(map(tuple, phase_noise.DEFAULTS["points"]))
    np.testing.assert_allclose(10 * np.log10(_oscillator.density(points, f)), level, atol=0.8)


@pytest.mark.parametrize("points", [FLAT, STEEP])
@pytest.mark.parametrize("delay_s", [None, 2e-6, 8e-6, 40e-6])
def test_covariance_inside_a_symbol_is_the_integral_of_the_spectrum(points, delay_s):
    """Structure function D(t) = 2 int S (1 - cos 2 pi f t): the sum of the split's two parts."""
    at = _oscillator.grid(*LOOK)
    lags = _oscillator.covariance(points, LOOK, delay_s)
    slow = _oscillator.density(points, at.slow_hz) * at.slow_weight
    if delay_s is not None:
        slow = slow * 4 * np.sin(np.pi * at.slow_hz * delay_s) ** 2
    for lag in (1, 7, 100, 255):
        t = lag * LOOK[3]
        got = 2 * (lags[0] - lags[lag]) + 4 * np.sum(slow * (1 - np.cos(2 * np.pi * at.slow_hz * t)))

        def weight(f, t=t):
            moved = 2 * (1 - np.cos(2 * np.pi * f * t))
            return moved if delay_s is None else moved * 4 * np.sin(np.pi * f * delay_s) ** 2

        # A white spectrum is white on the samples; the trapezoids of the truth end at half the sample rate too.
        assert got == pytest.approx(integral(points, weight, low=0.25), rel=4e-3)


@pytest.mark.parametrize("delay_s", [None, 4e-5])
def test_slow_part_is_interpolated_to_the_line_sum(delay_s):
    """Inside symbols too, against the sum of its lines with the same draws; a delay d keeps |1 - exp(-j 2 pi f d)|."""
    look = (12, 9, 2.5e-3, 1 / (9 * 120e3))
    at = _oscillator.grid(*look)
    got = _oscillator.slow_phase(STEEP, look, delay_s, np.random.default_rng(3))
    pair = np.random.default_rng(3).standard_normal((len(at.slow_hz), 2))
    size = np.sqrt(2 * _oscillator.density(STEEP, at.slow_hz) * at.slow_weight)
    size = size if delay_s is None else size * abs(1 - np.exp(-2j * np.pi * at.slow_hz * delay_s))
    # Numbers are drawn for the lines at the middle of the first symbol.
    times = np.arange(12)[:, None] * 2.5e-3 + (np.arange(9) - 4) * look[3]
    turns = 2 * np.pi * times[..., None] * at.slow_hz
    slow = np.sum(size * (pair[:, 0] * np.cos(turns) - pair[:, 1] * np.sin(turns)), axis=-1)
    np.testing.assert_allclose(got, slow, atol=1e-8 * abs(slow).max())


@pytest.mark.parametrize("delay_s", [None, 3e-6])
def test_phases_have_the_structure_of_the_spectrum(delay_s):
    phases = drawn(STEEP, delay_s)

    def expected(t):
        def weight(f):
            moved = 2 * (1 - np.cos(2 * np.pi * f * t))
            return moved if delay_s is None else moved * 4 * np.sin(np.pi * f * delay_s) ** 2

        return integral(STEEP, weight, low=0.25, count=1_000_000)

    for lag in (1, 60, 255):
        inside = np.mean((phases[:, :, lag] - phases[:, :, 0]) ** 2)
        assert inside == pytest.approx(expected(lag * LOOK[3]), rel=0.06)
    for lag in (1, 5):
        across = np.mean((phases[:, lag:, 17] - phases[:, :-lag, 17]) ** 2)
        assert across == pytest.approx(expected(lag * 2.5e-3), rel=0.08)


def test_symbol_to_symbol_spectrum_is_the_folded_one():
    """Welch's estimate of each symbol's mean phase against sum over folds of S(f) |D(f)|^2."""
    phases = drawn(STEEP, seeds=60).mean(axis=2)
    window = np.hanning(200)
    parts = np.concatenate([phases[:, :200], phases[:, 100:300], phases[:, 200:]])
    parts = parts - parts.mean(axis=1, keepdims=True)
    estimate = np.mean(abs(np.fft.rfft(parts * window, axis=1)) ** 2, axis=0) * 2.5e-3 / np.sum(window**2)
    f = np.fft.rfftfreq(200, 2.5e-3)
    folds = np.arange(-3000, 3001)[:, None] * 400.0 + f
    inside = np.abs(folds) < 15.36e6
    steps = LOOK[3] * folds
    mean = np.sin(np.pi * 256 * steps) / (256 * np.sin(np.pi * steps) + (steps == 0))
    mean[steps == 0] = 1
    truth = np.sum(_oscillator.density(STEEP, np.maximum(abs(folds), 1e-3)) * mean**2 * inside, axis=0)
    keep = slice(8, -2)  # the window smears the steep end near zero
    np.testing.assert_allclose(10 * np.log10(estimate[keep] / truth[keep]), 0, atol=1.6)
    assert abs(np.mean(10 * np.log10(estimate[keep] / truth[keep]))) < 0.25


def test_leakage_between_subcarriers_is_the_integral_of_the_spectrum():
    """Small phase: leaked power is int S (1 - |D(f)|^2), D the mean of a tone over a symbol (Petrovic et al. 2007)."""
    look = frame(network())
    points = [[offset, level - 10] for offset, level in STEEP]
    out = received(phase_noise, {"points": points, "shared": False}, look, np.ones((400, 256)))
    common = (out.mean(axis=1) / abs(out.mean(axis=1)))[:, None]
    leaked = np.mean(abs(out * common.conj() - abs(out.mean(axis=1))[:, None]) ** 2)

    def weight(f):
        step = LOOK[3] * f
        return 1 - (np.sin(np.pi * 256 * step) / (256 * np.sin(np.pi * step))) ** 2

    assert leaked == pytest.approx(integral(tuple(map(tuple, points)), weight), rel=0.03)
    assert np.mean(abs(out) ** 2) == pytest.approx(1, rel=1e-12)


def test_a_shared_oscillator_cancels_what_is_slower_than_the_echo():
    """Range correlation: variance of phi(t) - phi(t - tau) is int S 4 sin^2(pi f tau)."""
    for delay in (1e-7, 2e-6):
        got = np.var(drawn(STEEP, delay, seeds=20))
        want = integral(STEEP, lambda f, d=delay: 4 * np.sin(np.pi * f * d) ** 2, count=1_000_000)
        assert got == pytest.approx(want, rel=0.05)
    assert not drawn(STEEP, 0.0, seeds=1).any()


def test_coherence_falls_as_a_gaussian_phase_says():
    """|E exp(j phi)| = exp(-var / 2), here of a white phase that is not small."""
    points = ((1.0, 10 * math.log10(1.0 / (256 * 120e3))),)
    turn = np.exp(1j * drawn(points, seeds=3))
    assert abs(turn.mean()) == pytest.approx(math.exp(-0.5), rel=0.01)


@settings(max_examples=30, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(-1, 9), st.floats(-300, 60)), min_size=1, max_size=6, unique_by=lambda p: round(p[0], 2)
    ),
    st.sampled_from([None, 0.0, 1e-10, 3e-6, 1e-3]),
)
def test_no_spectrum_breaks_the_synthesis(pairs, delay_s):
    points = tuple((10**offset, level) for offset, level in sorted(pairs))
    look = (5, 32, 2.5e-3, 1 / (32 * 120e3))
    assert np.isfinite(_oscillator.phase(points, look, delay_s, np.random.default_rng(1))).all()


@pytest.mark.parametrize(
    "look", [(6, 1, 2.5e-3, 1 / 120e3), (6, 7, 2.5e-3, 1 / 840e3), (8, 128, 1e-5, 1 / (128 * 120e3))]
)
def test_odd_looks_have_the_right_variance(look):
    at = _oscillator.grid(*look)
    total = _oscillator.covariance(FLAT, look, None)[0] + 2 * np.sum(
        _oscillator.density(FLAT, at.slow_hz) * at.slow_weight
    )
    # White to half the sample rate, except for the missing line at zero.
    assert total == pytest.approx(1e-9 / look[3], rel=0.01)
    assert np.isfinite(_oscillator.phase(FLAT, look, None, np.random.default_rng(1))).all()


@pytest.mark.parametrize(
    ("given", "radar", "message"),
    [
        ({"points": [[10.0, -80.0], [5.0, -90.0]]}, network(), "expected positive and rising"),
        ({"points": [[0.0, -80.0]]}, network(), "expected positive and rising"),
        ({}, network(8, 4, 1e-5), "symbol_interval_s is 1e-05, expected at least"),
    ],
)
def test_impossible_spectra_are_refused(given, radar, message):
    with pytest.raises(InputError, match=message):
        phase_noise.check({**phase_noise.DEFAULTS, **given}, checked(radar))


@pytest.mark.parametrize("symbols, subcarriers", [(12, 64), (5, 7)])
@pytest.mark.parametrize("delay_s", [None, 2e-6])
def test_both_parts_come_of_one_stream_one_after_the_other(symbols, subcarriers, delay_s):
    look = (symbols, subcarriers, 0.0025, 1 / (subcarriers * 120e3))
    rng = stream(3, "phase")
    slow = _oscillator.slow_phase(STEEP, look, delay_s, rng)
    lags = _oscillator.covariance(STEEP, look, delay_s)
    matrix = lags[abs(np.subtract.outer(np.arange(subcarriers), np.arange(subcarriers)))]
    numbers = rng.standard_normal((symbols, subcarriers))
    fast = [
        numbers[:, first::2] @ np.linalg.cholesky(part.T @ matrix @ part).T
        for first, part in enumerate(_toeplitz.parts(np.eye(subcarriers)))
    ]
    expected = slow + _toeplitz.joined(*fast)
    got = _oscillator.phase(STEEP, look, delay_s, stream(3, "phase"))
    np.testing.assert_allclose(got, expected, atol=1e-9 * abs(expected).max())
