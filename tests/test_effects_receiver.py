"""Receiver effects: each setting is read back from the signal, against closed forms and slow sums."""

import math
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import j0

from effects_frames import frame, network, point, received
from lowalt.common.errors import InputError
from lowalt.effects import waveform
from lowalt.effects.catalogue import ORDER, called
from lowalt.effects.receiver import (
    _offsets,
    _oscillator,
    adc,
    carrier_offset,
    clock_offset,
    iq_imbalance,
    phase_noise,
    receiver_noise,
    timing_offset,
)

C = 299_792_458.0
IDLE = [
    (receiver_noise, {"temperature_k": 0}),
    (timing_offset, {"sigma_s": 0}),
    (clock_offset, {"sigma_ppm": 0}),
    (carrier_offset, {"sigma_ppm": 0}),
    (phase_noise, {"points": []}),
    (iq_imbalance, {"gain_db": 0, "phase_deg": 0}),
    (adc, {"bits": 0}),
    (adc, {"bits": None}),
]
# Settings of strength `s`: a factor on each effect's change.
FAINT = [
    (receiver_noise, lambda s: {"temperature_k": 290 * s**2}),
    (timing_offset, lambda s: {"sigma_s": 2e-8 * s}),
    (clock_offset, lambda s: {"sigma_ppm": 0.017 * s}),
    (carrier_offset, lambda s: {"sigma_ppm": 0.017 * s}),
    (phase_noise, lambda s: {"level_db": 20 * math.log10(s), "shared": False, "loop_hz": 0.0}),
    (iq_imbalance, lambda s: {"gain_db": 0.5 * s, "phase_deg": 2 * s}),
    (adc, lambda s: {"bits": 12 - round(math.log2(s))}),
]


def checked(radar, **effects):
    """The scene that `check` looks at."""
    return SimpleNamespace(network=radar, effects=effects)


def strongest(cells: np.ndarray) -> np.ndarray:
    """Range (cells) of the strongest return of each symbol, by a parabola through an oversampled transform's peak."""
    over = 64
    size = abs(np.fft.ifft(cells, over * cells.shape[1], axis=1))
    top = size.argmax(axis=1)
    rows = np.arange(len(size))
    left, mid, right = (size[rows, (top + step) % size.shape[1]] for step in (-1, 0, 1))
    return (top + 0.5 * (left - right) / (left - 2 * mid + right)) / over


# The waveform


@pytest.mark.parametrize("subcarriers", [1, 2, 7, 64])
def test_samples_are_the_sum_of_subcarriers_about_the_oscillator(subcarriers):
    look = frame(network(5, subcarriers))
    rng = np.random.default_rng(0)
    responses = rng.standard_normal((5, subcarriers)) + 1j * rng.standard_normal((5, subcarriers))
    samples = waveform.transmit(responses, look.sent)
    slow = np.zeros_like(samples)
    for m, hertz in enumerate(look.baseband_hz):
        slow += np.outer(
            responses[:, m] * look.sent[:, m], np.exp(2j * np.pi * hertz * look.sample_times_s) / subcarriers
        )
    np.testing.assert_allclose(samples, slow, atol=1e-13)
    np.testing.assert_allclose(waveform.demodulate(samples, look.sent), responses, atol=1e-13)
    assert np.linalg.norm(samples) * math.sqrt(subcarriers) == pytest.approx(np.linalg.norm(responses))
    assert look.baseband_hz[subcarriers // 2] == 0


def test_data_is_qpsk_of_unit_modulus():
    data = waveform.sent(np.random.default_rng(3), 300, 200)
    np.testing.assert_allclose(abs(data), 1, rtol=1e-15)
    turns, counts = np.unique(np.round(np.angle(data) / (np.pi / 2) - 0.5), return_counts=True)
    assert len(turns) == 4
    assert abs(counts - 15_000).max() < 5 * math.sqrt(60_000 * 3 / 16)
    assert frame(network()).times_s[3, 5] == 3 * 2.5e-3 + 5 / (256 * 120e3)


# All effects


@pytest.mark.parametrize("name", [entry.partition("/")[2] for entry in ORDER if entry[:3] in ("rec", "det", "tra")])
def test_defaults_are_what_the_schema_describes_and_allows(name):
    text = (Path(__file__).parent.parent / "workflow/schemas/config.schema.yaml").read_text()
    block = yaml.safe_load(text)["properties"]["effects"]["properties"][name]
    (effect,) = called({name: {}})
    assert set(block["properties"]) == set(effect.module.DEFAULTS)
    assert all(item["description"] for item in (block, *block["properties"].values()))
    jsonschema.validate(effect.module.DEFAULTS, block)


@pytest.mark.parametrize(("module", "given"), IDLE)
def test_strength_zero_is_dropped(module, given):
    name = module.__name__.rpartition(".")[2]
    assert called({name: given}) == []
    assert [effect.name for effect in called({name: {}})] == [name]
    assert module.SOURCE


@pytest.mark.parametrize(("module", "strength"), FAINT)
def test_vanishing_strength_is_continuous(module, strength):
    look = frame(network(40, 64), delay_s=1e-6)
    # A link budget's noise has its own scale; the others are relative.
    scale = 1e-6 if module is receiver_noise else 1.0
    plain = scale * point(look, 12.3, 40.0)
    change = [np.linalg.norm(received(module, strength(s), look, plain) - plain) for s in (2.0**-10, 2.0**-20)]
    assert 0 < change[1] < 1e-2 * change[0] < 1e-2 * np.linalg.norm(plain)


@pytest.mark.parametrize(("module", "strength"), FAINT)
def test_draws_are_as_many_whatever_the_strength(module, strength):
    look = frame(network(20, 32), delay_s=1e-6)
    samples = waveform.transmit(point(look, 3.0), look.sent)
    after = []
    for s in (1.0, 0.25):
        rng = np.random.default_rng(5)
        module.receive({**module.DEFAULTS, **strength(s)}, samples, look, rng)
        after.append(rng.bit_generator.state["state"]["state"])
    assert after[0] == after[1]


@pytest.mark.parametrize(("module", "strength"), FAINT)
def test_errors_grow_by_no_more_than_amplifies(module, strength):
    chosen = {**module.DEFAULTS, **strength(1.0)}
    factor = module.amplifies(chosen) if hasattr(module, "amplifies") else 1.0
    look = frame(network(20, 32), delay_s=1e-6)
    rng = np.random.default_rng(2)
    first, error = rng.standard_normal((2, 20, 64)).view(complex)
    apart = [module.receive(chosen, values, look, np.random.default_rng(1)) for values in (first, first + 0.1 * error)]
    assert np.linalg.norm(apart[1] - apart[0]) <= factor * 0.1 * np.linalg.norm(error) * (1 + 1e-12)


# Receiver noise


def test_noise_of_a_subcarrier_is_the_link_budget():
    look = frame(network(400, 64))
    noise = received(receiver_noise, {}, look, np.zeros((400, 64)))
    expected = 1.380649e-23 * 290 * 120e3 * 10**0.7
    assert np.mean(abs(noise) ** 2) == pytest.approx(expected, rel=5 / math.sqrt(25_600))
    assert abs(np.mean(noise**2)) < 5 * expected / math.sqrt(25_600)
    assert receiver_noise.variance(receiver_noise.DEFAULTS, 120e3) == pytest.approx(expected)


def test_range_compression_gains_m():
    look = frame(network(2000, 64))
    before = received(receiver_noise, {}, look, np.zeros((2000, 64)))
    cells = np.fft.ifft(before, axis=1)
    gain = np.mean(abs(before) ** 2) / np.mean(abs(cells) ** 2)
    assert gain == pytest.approx(64, rel=1e-12)
    clean = np.fft.ifft(point(look, 9.0), axis=1)[:, 9]
    np.testing.assert_allclose(abs(clean), 1, rtol=1e-12)


@pytest.mark.parametrize("snr_db", [3.0, 6.0, 9.0])
def test_wrong_cells_are_as_frequent_as_theory_says(snr_db):
    """One point in a cell's middle against M - 1 cells of noise: noncoherent orthogonal signalling.

    P(right) = sum_k (-1)^k C(M-1, k) / (k+1) exp(-k/(k+1) SNR) (Proakis, Digital Communications, Eq. 4.5-44).
    """
    cells, trials = 16, 40_000
    look = frame(network(trials, cells))
    snr = 10 ** (snr_db / 10)
    noise = receiver_noise.variance(receiver_noise.DEFAULTS, 120e3) / cells
    response = point(look, 5.0) * math.sqrt(snr * noise)
    chosen = abs(np.fft.ifft(received(receiver_noise, {}, look, response), axis=1)).argmax(axis=1)
    right = sum((-1) ** k * math.comb(cells - 1, k) / (k + 1) * math.exp(-k / (k + 1) * snr) for k in range(cells))
    wrong = np.mean(chosen != 5)
    assert wrong == pytest.approx(1 - right, abs=4.5 * math.sqrt(right * (1 - right) / trials))


# Offsets


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


@pytest.mark.parametrize("ppm", [-3.0, 0.05, 20.0])
def test_a_fast_clock_is_the_symbol_sum_at_its_own_instants(ppm):
    look = frame(network(6, 15))
    rng = np.random.default_rng(4)
    responses = rng.standard_normal((6, 15)) + 1j * rng.standard_normal((6, 15))
    samples = clock_offset.receive(
        {**clock_offset.DEFAULTS, "fixed_ppm": ppm, "sigma_ppm": 0}, waveform.transmit(responses, look.sent), look, rng
    )
    slow = np.zeros((6, 15), complex)
    for n in range(6):
        for i in range(15):
            instant = (n * 2.5e-3 + i * look.sample_s) / (1 + ppm * 1e-6) - n * 2.5e-3
            tones = np.exp(2j * np.pi * look.baseband_hz * instant)
            slow[n, i] = np.sum(responses[n] * look.sent[n] * tones) / 15
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
    assert not adc.receive(adc.DEFAULTS, np.zeros((2, 4), complex), None, None).any()


# Phase noise

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
    lags = _oscillator.covariance(points, at, delay_s)
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
    times = np.arange(12)[:, None] * 2.5e-3 + np.arange(9) * look[3]
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
    total = _oscillator.covariance(FLAT, at, None)[0] + 2 * np.sum(
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
