"""Offsets of clocks and carriers: drawn and fixed parts, and each offset read back from the signal."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from effects_frames import checked, frame, network, point, received
from lowalt.common.errors import InputError
from lowalt.effects import waveform
from lowalt.effects.receiver import (
    _offsets,
    carrier_offset,
    clock_offset,
    timing_offset,
)

C = 299_792_458.0


def strongest(cells: np.ndarray) -> np.ndarray:
    """Range (cells) of the strongest return of each symbol, by a parabola through an oversampled transform's peak."""
    over = 64
    size = abs(np.fft.ifft(cells, over * cells.shape[1], axis=1))
    top = size.argmax(axis=1)
    rows = np.arange(len(size))
    left, mid, right = (size[rows, (top + step) % size.shape[1]] for step in (-1, 0, 1))
    return (top + 0.5 * (left - right) / (left - 2 * mid + right)) / over


def test_drawn_offsets_are_normal_and_cut():
    rng = np.random.default_rng(1)
    drawn = np.array([_offsets.drawn(rng) for _ in range(20_000)])
    assert abs(drawn).max() <= 3
    assert np.std(drawn) == pytest.approx(0.98658, abs=0.02)  # sqrt(1 - 6 phi(3) / (2 Phi(3) - 1))
    assert np.mean(abs(drawn) < 1) == pytest.approx(0.6827 / 0.9973, abs=0.015)


def test_each_station_has_its_fixed_offset():
    radar = network(4, 32)
    given = {"fixed_s": {"A": 1e-8, "B": -2e-8}, "sigma_s": 0}
    late = [
        timing_offset.late_s({**timing_offset.DEFAULTS, **given}, frame(radar, name), np.random.default_rng(1))
        for name in "ABC"
    ]
    assert late == [1e-8, -2e-8, 0]
    with pytest.raises(InputError, match=r"timing_offset.fixed_s: station\(s\) \['Z'\]"):
        timing_offset.check({**timing_offset.DEFAULTS, "fixed_s": {"Z": 1e-9}}, checked(radar))


@settings(max_examples=20, deadline=None)
@given(st.floats(-2.5e-7, 2.5e-7), st.floats(10.0, 40.0))
def test_a_late_window_brings_echoes_nearer(late, cell):
    look = frame(network(2, 64))
    plain = point(look, cell)
    moved = received(timing_offset, {"fixed_s": late, "sigma_s": 0}, look, plain)
    shift = late * 64 * 120e3
    centre = look.network.subcarriers // 2
    # Exactly the response of a point nearer by the shift, with the oscillator's own subcarrier left as it was.
    np.testing.assert_allclose(
        moved, point(look, cell - shift) * (plain / point(look, cell - shift))[0, centre], atol=1e-9
    )
    np.testing.assert_allclose(strongest(moved), cell - shift, atol=1e-3)


def test_slips_beyond_the_prefix_are_refused():
    radar = network()
    with pytest.raises(InputError, match="timing_offset: the window can be off by"):
        timing_offset.check({**timing_offset.DEFAULTS, "sigma_s": 1e-7}, checked(radar))
    clock = {**clock_offset.DEFAULTS, "fixed_ppm": 0.25, "sigma_ppm": 0}
    clock_offset.check(clock, checked(radar))
    with pytest.raises(InputError, match="clock_offset: the window slips"):
        clock_offset.check(clock, checked(radar, timing_offset=timing_offset.DEFAULTS))
    timing_offset.check(timing_offset.DEFAULTS, checked(radar))


@pytest.mark.parametrize("subcarriers", [15, 256])
@pytest.mark.parametrize("ppm", [-3.0, 0.05, 20.0])
def test_a_fast_clock_is_the_symbol_sum_at_its_own_instants(ppm, subcarriers):
    look = frame(network(6, subcarriers))
    rng = np.random.default_rng(4)
    responses = rng.standard_normal((6, subcarriers)) + 1j * rng.standard_normal((6, subcarriers))
    samples = clock_offset.receive(
        {**clock_offset.DEFAULTS, "fixed_ppm": ppm, "sigma_ppm": 0}, waveform.transmit(responses, look.sent), look, rng
    )
    slow = np.zeros((6, subcarriers), complex)
    for n in range(6):
        for i in range(subcarriers):
            instant = (n * 2.5e-3 + i * look.sample_s) / (1 + ppm * 1e-6) - n * 2.5e-3
            tones = np.exp(2j * np.pi * look.baseband_hz * instant)
            slow[n, i] = np.sum(responses[n] * look.sent[n] * tones) / subcarriers
    np.testing.assert_allclose(samples, slow, atol=1e-10)


def test_clock_offset_makes_ranges_drift_and_lines_stay():
    look = frame(network())
    moved = received(clock_offset, {"fixed_ppm": 0.2, "sigma_ppm": 0}, look, point(look, 60.0))
    drift_m = (strongest(moved) - 60.0) * look.network.cell_m
    slope = np.polyfit(look.symbol_times_s, drift_m, 1)[0]
    assert slope == pytest.approx(C * 0.2e-6 / 2, rel=2e-3)
    # Another effect models the oscillator, so the subcarrier at its frequency turns only by leakage from others.
    assert abs(np.angle(moved[:, 128])).max() < 1e-3


@pytest.mark.parametrize(("hertz", "folded"), [(30.0, 30.0), (-55.0, -55.0), (250.0, -150.0), (1234.0, 34.0)])
def test_carrier_offset_moves_lines_folded(hertz, folded):
    look = frame(network())
    moved = received(carrier_offset, {"fixed_hz": hertz, "sigma_ppm": 0}, look, point(look, 20.0, 0.0))
    line = np.fft.ifft(moved, axis=1)[:, 20]
    size = abs(np.fft.fft(line))
    assert np.fft.fftfreq(400, 2.5e-3)[size.argmax()] == pytest.approx(folded)


def test_carrier_offset_in_ppm_is_of_the_oscillator():
    look = frame(network(), "C")
    given = {**carrier_offset.DEFAULTS, "fixed_ppm": 0.05, "fixed_hz": 3.0, "sigma_ppm": 0}
    expected = 3.0 + 0.05e-6 * (4.9e9 + 2 * 265 * 120e3 + 128 * 120e3)
    assert carrier_offset.offset_hz(given, look, np.random.default_rng(1)) == pytest.approx(expected)


def test_carrier_offset_leaks_as_the_dirichlet_kernel_says():
    look = frame(network(300, 64))
    share = 0.3
    moved = received(carrier_offset, {"fixed_hz": share * 120e3, "sigma_ppm": 0}, look, np.ones((300, 64)))
    # Moose 1994: the subcarrier keeps sin(pi e) / (M sin(pi e / M)); all power is kept, so the rest is leakage.
    kept = math.sin(math.pi * share) / (64 * math.sin(math.pi * share / 64))
    turn = np.exp(2j * np.pi * share * 120e3 * look.symbol_times_s)[:, None]
    own = np.mean(moved * turn.conj())
    assert abs(own) == pytest.approx(kept, rel=0.02)
    assert np.mean(abs(moved) ** 2) == pytest.approx(1, rel=1e-12)


def test_an_offset_without_a_fixed_part_reaches_as_far_as_its_draws():
    assert _offsets.largest({}, 0.5) == _offsets.largest(0.0, 0.5) == _offsets.CUT * 0.5
    assert _offsets.largest({"A": -3.0, "B": 2.0}, 0.5) == 3.0 + _offsets.CUT * 0.5
