"""The receiver's two branches and their converters: IQ imbalance and quantisation against closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import j0

from effects_frames import frame, network, received
from lowalt.effects.receiver import (
    adc,
    iq_imbalance,
)

# IQ imbalance


@settings(max_examples=30, deadline=None)
@given(st.floats(-6, 6), st.floats(-30, 30), st.sampled_from([16, 17]), st.integers(0, 15))
def test_image_rejection_is_the_closed_form(gain_db, phase_deg, subcarriers, tone):
    look = frame(network(1, subcarriers))
    look.sent[:] = 1
    response = np.zeros((1, subcarriers), complex)
    response[0, tone] = 1
    out = received(iq_imbalance, {"gain_db": gain_db, "phase_deg": phase_deg}, look, response)[0]
    mirror = (2 * (subcarriers // 2) - tone) % subcarriers
    gain, phi = 10 ** (gain_db / 20), math.radians(phase_deg)
    above, below = 1 + gain**2 + 2 * gain * math.cos(phi), 1 + gain**2 - 2 * gain * math.cos(phi)
    if mirror != tone:
        assert abs(out[tone]) ** 2 == pytest.approx(above / 4, abs=1e-12)
        assert abs(out[mirror]) ** 2 == pytest.approx(below / 4, abs=1e-12)
    rest = np.delete(out, [tone, mirror])
    assert abs(rest).max() < 1e-13


def test_branches_are_i_and_a_skewed_q():
    r = np.random.default_rng(0).standard_normal((3, 8)).view(complex)
    out = iq_imbalance.receive({"gain_db": 2.0, "phase_deg": 11.0}, r, None, None)
    np.testing.assert_allclose(out.real, r.real, atol=1e-15)
    q = 10**0.1 * (r * np.exp(-1j * math.radians(11))).imag
    np.testing.assert_allclose(out.imag, q, atol=1e-15)


def test_a_sample_of_the_worst_phase_grows_by_what_amplifies_says():
    setting, phases = {"gain_db": 3.0, "phase_deg": 20.0}, np.exp(2j * np.pi * np.arange(3600) / 3600)
    largest = abs(iq_imbalance.receive(setting, phases, None, None)).max()
    assert iq_imbalance.amplifies(setting) == pytest.approx(largest, rel=1e-6)


# Converter


@pytest.mark.parametrize("bits", range(4, 17))
def test_full_scale_sine_has_six_decibels_a_bit(bits):
    tone = np.exp(2j * np.pi * 0.1234567 * np.arange(400_003))
    out, clipped = adc.quantise(tone, bits, 1.0)
    assert clipped == 0
    ratio = 0.5 / np.mean((out.real - tone.real) ** 2)
    # Bennett's exact error of a sine of A = 2^(b-1) steps: step^2 (1/12 + sum_k J0(2 pi k A / step) / (pi k)^2).
    k = np.arange(1, 2000)
    exact = 0.5 * 4.0 ** (bits - 1) / (1 / 12 + np.sum(j0(np.pi * k * 2**bits) / (np.pi * k) ** 2))
    assert ratio == pytest.approx(exact, rel=0.01)
    # The rule of thumb leaves that sum out; |J0(x)| <= sqrt(2 / pi x) bounds each of its terms.
    ripple = 10 * math.log10(1 + 12 / math.pi**2 * 1.342 * math.sqrt(2 / (math.pi**2 * 2**bits)))
    assert 10 * math.log10(ratio) == pytest.approx(6.0206 * bits + 1.7609, abs=ripple + 0.02)


@pytest.mark.parametrize("backoff_db", [0.0, 6.0, 9.5])
def test_clipping_of_gaussian_samples(backoff_db):
    r = np.random.default_rng(2).standard_normal((400, 512)).view(complex)
    scale = adc.full_scale(r, backoff_db)
    out, clipped = adc.quantise(r, 14, scale)
    count, x = r.size * 2, 10 ** (backoff_db / 20)
    tail = math.erfc(x / math.sqrt(2))
    assert clipped / count == pytest.approx(tail, abs=5 * math.sqrt(tail / count))
    # E (|x| - A)^2 beyond A, for unit variance: 2 [(1 + A^2) Q(A) - A phi(A)].
    overload = (1 + x**2) * tail - 2 * x * math.exp(-(x**2) / 2) / math.sqrt(2 * math.pi)
    assert np.mean((out - r).real ** 2) == pytest.approx(overload + (2 * x / 2**14) ** 2 / 12, rel=0.15)
    assert abs(out.real).max() < scale
    free, _ = adc.quantise(r, 14, scale, clip=False)
    assert abs((free - r).real).max() <= scale / 2**14 * (1 + 1e-9)


def test_one_bit_keeps_signs_and_zeros_stay():
    r = np.array([[0.3 - 0.7j, -5 + 0.01j]])
    np.testing.assert_allclose(adc.quantise(r, 1, 1.0)[0], [[0.5 - 0.5j, -0.5 + 0.5j]])
    levels = np.unique(adc.receive({**adc.DEFAULTS, "bits": 1}, r, None, None).real)
    assert adc.step({**adc.DEFAULTS, "bits": 1}, r) == pytest.approx(levels[1] - levels[0])
    assert not adc.receive(adc.DEFAULTS, np.zeros((2, 4), complex), None, None).any()
