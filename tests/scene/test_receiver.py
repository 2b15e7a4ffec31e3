"""What a receiver does to time samples: laws read back out of the samples, and sums one by one."""

import numpy as np
import pytest

from lowalt.numerics.streams import stream
from lowalt.scene import waveform
from lowalt.scene.effects.receiver import (
    adc,
    carrier_offset,
    cell_noise,
    clock_offset,
    iq_imbalance,
    link_offset,
    phase_noise,
    receiver_noise,
    timing_offset,
    transmit_leakage,
)
from lowalt.scene.laws.offsets import of_stations
from scenes import A, B, link, linked, network


def look_of(radio, station=A, delay_s=2e-6, reference=1.0, times_s=None):
    data = waveform.qpsk(stream(1, "data"), radio.symbols, radio.subcarriers)
    times_s = radio.times_s if times_s is None else times_s
    return waveform.Look(radio, station, data, data, times_s, reference, delay_s)


def heard(effect, changes, response, look, rng=None):
    """The response (N, M) behind one effect."""
    samples = waveform.transmit(np.array(response), look.aired)
    return waveform.demodulate(
        effect.receive(effect.DEFAULTS | changes, samples, look, rng or stream(2, "x")), look.data
    )


def echo(look, delay_s, doppler_hz=0.0):
    """The response (N, M) of a point at a delay."""
    return np.exp(2j * np.pi * (doppler_hz * look.times_s[:, None] - delay_s * look.baseband_hz))


def test_a_late_window_makes_echoes_nearer():
    look = look_of(network())
    late_s = 3 * look.sample_s
    found = heard(
        timing_offset, {"fixed_s": late_s, "sigma_s": 0.0}, echo(look, 10 * look.sample_s), look
    )
    np.testing.assert_allclose(found, echo(look, 7 * look.sample_s), atol=1e-12)


def test_a_carrier_offset_moves_every_line_and_leaks_as_summed_sample_by_sample():
    look = look_of(network(symbols=3))
    samples = waveform.transmit(echo(look, 2e-6), look.aired)
    settings = carrier_offset.DEFAULTS | {"fixed_ppm": 700e6 / look.oscillator_hz, "sigma_ppm": 0.0}
    found = carrier_offset.receive(settings, samples, look, stream(2, "x"))
    for n, i in np.ndindex(samples.shape):
        turn = np.exp(2j * np.pi * 700.0 * (n * 2.5e-3 + i * look.sample_s))
        assert abs(found[n, i] - samples[n, i] * turn) < 1e-12 * abs(samples).max()


@pytest.mark.parametrize("ppm", [0.05, -30.0])
def test_a_fast_clock_takes_each_sample_at_its_own_instant(ppm):
    look = look_of(network(symbols=3))
    samples = waveform.transmit(echo(look, 2e-6), look.aired)
    settings = clock_offset.DEFAULTS | {"fixed_ppm": ppm, "sigma_ppm": 0.0}
    found = clock_offset.receive(settings, samples, look, stream(2, "x"))
    sent = echo(look, 2e-6) * look.aired
    for n, i in np.ndindex(samples.shape):
        instant = n * 2.5e-3 + i * look.sample_s
        early = instant / (1 + 1e-6 * ppm) - n * 2.5e-3
        truth = (sent[n] * np.exp(2j * np.pi * look.baseband_hz * early)).mean()
        assert abs(found[n, i] - truth) < 1e-11


def test_links_have_opposite_offsets_and_a_station_none():
    radio = linked()
    one, other, own = (look_of(radio, station) for station in (link(), link(B, A), A))
    changes = {"sigma_ppm": 0.01, "sigma_s": 2e-8}
    there, back, here = (
        heard(link_offset, changes, echo(look, 2e-6), look, stream(3, "look"))
        for look in (one, other, own)
    )
    np.testing.assert_allclose(here, echo(own, 2e-6), atol=1e-12)
    assert abs(there - echo(one, 2e-6)).max() > 0.1
    # Up to the leakage between subcarriers and the stations' sub-bands, one link undoes what the
    # other does.
    np.testing.assert_allclose((there * back)[0], (echo(one, 2e-6) ** 2)[0], atol=1e-3)


def test_a_sender_that_is_high_raises_lines_and_one_that_is_late_makes_echoes_late():
    look = look_of(linked(), link())
    changes = {"sigma_ppm": 0.01, "sigma_s": 2e-8}
    errors = of_stations(changes, look.network, stream(3, "look"))
    ppm, late_s = np.subtract(errors["A"], errors["B"])
    late = heard(
        link_offset, changes | {"sigma_ppm": 0.0}, echo(look, 2e-6), look, stream(3, "look")
    )
    np.testing.assert_allclose(late, echo(look, 2e-6 + late_s), atol=1e-12)
    high = heard(link_offset, changes | {"sigma_s": 0.0}, echo(look, 2e-6), look, stream(3, "look"))
    turns = np.angle(high[1:] / high[:-1]) / (2 * np.pi)
    np.testing.assert_allclose(turns, 1e-6 * ppm * look.oscillator_hz * 2.5e-3, atol=1e-3)


def test_noise_is_white_of_the_level_that_link_budget_and_snr_ask_for():
    radio = network(symbols=4000)
    look = look_of(radio, reference=4.0)
    for effect, changes, variance in (
        (receiver_noise, {}, 1.380649e-23 * 290 * 120e3 * 10**0.7 / 32),
        (receiver_noise, {"temperature_k": 77.0}, 1.380649e-23 * 77 * 120e3 * 10**0.7 / 32),
        (cell_noise, {"snr_db": 13.0}, 4.0 / 10**1.3),
    ):
        cells = waveform.range_cells(heard(effect, changes, np.zeros(look.data.shape), look))
        np.testing.assert_allclose((abs(cells) ** 2).mean(axis=0), variance, rtol=0.1)
        assert abs((cells[1:] * cells[:-1].conj()).mean()) < 0.01 * variance
        assert abs((cells[:, 1:] * cells[:, :-1].conj()).mean()) < 0.01 * variance
        assert abs((cells**2).mean()) < 0.01 * variance


def test_no_snr_adds_no_noise():
    look = look_of(network())
    np.testing.assert_allclose(
        heard(cell_noise, {}, echo(look, 2e-6), look), echo(look, 2e-6), atol=1e-12
    )


def test_leakage_stands_still_at_its_delay_and_level():
    look = look_of(network())
    changes = {"isolation_db": 60.0, "delay_s": 2 * look.sample_s}
    cells = waveform.range_cells(heard(transmit_leakage, changes, np.zeros(look.data.shape), look))
    np.testing.assert_allclose(abs(cells[:, 2]), 1e-3, rtol=1e-9)
    assert abs(np.delete(cells, 2, axis=1)).max() < 1e-12


def test_a_mixer_images_each_subcarrier_in_its_mirror():
    look = look_of(network())
    mu, nu = iq_imbalance.coefficients(iq_imbalance.DEFAULTS)
    samples = np.exp(2j * np.pi * 5 * np.arange(32) / 32)[None]
    found = np.fft.fft(iq_imbalance.receive(iq_imbalance.DEFAULTS, samples, look, None))[0] / 32
    np.testing.assert_allclose(found[[5, -5]], [mu, nu], atol=1e-12)
    assert abs(np.delete(found, [5, 27])).max() < 1e-12
    g = 10 ** (0.5 / 20)
    phi = np.radians(2.0)
    # The I branch sees the real part, the Q branch the imaginary part of what lags by phi, g times.
    r = np.exp(1j * np.linspace(0, 6, 7))
    np.testing.assert_allclose(
        mu * r + nu * r.conj(), r.real + 1j * g * (r * np.exp(-1j * phi)).imag, atol=1e-14
    )


def test_a_converter_errs_as_uniform_steps_do_and_clips():
    rng = np.random.default_rng(1)
    samples = rng.standard_normal((50, 32)) + 1j * rng.standard_normal((50, 32))
    found = adc.receive(adc.DEFAULTS | {"bits": 10}, samples, look_of(network()), None)
    step = adc.full_scale_of(samples, 12.0) * 2**-9
    assert np.mean(abs(found - samples) ** 2) == pytest.approx(step**2 / 6, rel=0.1)
    coarse = adc.quantise(np.array([0.1, 0.9, 3.0, -3.0]) + 0j, 2, 1.0)
    assert coarse.real.tolist() == [0.25, 0.75, 0.75, -0.75]
    assert not adc.receive(adc.DEFAULTS, np.zeros((2, 4), complex), None, None).any()


def test_only_clipping_costs_a_look_with_strong_symbols_more_than_quantisation():
    samples = np.random.default_rng(2).standard_normal((400, 256, 2)) @ [1, 1j]
    uneven = samples * np.where(np.arange(400) % 20 == 0, 10 ** (6 / 20), 1.0)[:, None]
    for look, backoff_db, expected_db in (
        (samples, 12.0, 40.5),
        (uneven, 12.0, 29.2),
        (uneven, 18.0, 34.9),
    ):
        error = adc.receive({"bits": 8, "backoff_db": backoff_db}, look, None, None) - look
        # Steps of full scale / 2^7: a component's error has a twelfth of a step's square.
        quantised_db = 10 * np.log10(12 * 2**14) - backoff_db
        power = np.mean(abs(look) ** 2)
        whole = adc.full_scale_of(look, backoff_db)
        inside = np.maximum(abs(look.real), abs(look.imag)) < whole
        assert 10 * np.log10(power / np.mean(abs(error) ** 2)) == pytest.approx(
            expected_db, abs=0.3
        )
        # Leaving out the samples that clip, and nothing else, gives what quantisation alone gives.
        assert 10 * np.log10(power / np.mean(abs(error[inside]) ** 2)) == pytest.approx(
            quantised_db, abs=0.1
        )


def integral(settings, weight, low=1e-1, high=32 * 60e3):
    """Slow truth: the two-sided integral of the density times weight(f), by trapezoids in log f."""
    f = np.geomspace(low, high, 200_000)
    values = phase_noise.density(settings, f) * weight(f) * f
    return 2 * np.trapezoid(values, np.log(f))


@pytest.mark.parametrize(
    "changes", [{"shared": False}, {"shared": True}, {"shared": False, "loop_hz": 0.0}]
)
def test_phase_within_a_symbol_wanders_as_its_spectrum_says(changes):
    """Structure function D(t) = 2 int S (1 - cos 2 pi f t), of both parts of the split together."""
    settings = phase_noise.DEFAULTS | changes
    delay_s = 2e-6
    look = look_of(network(symbols=400), delay_s=delay_s)
    phases = np.concatenate(
        [phase_noise.phase(settings, look, stream(4, "p", k)) for k in range(20)]
    )
    for lag in (1, 5, 31):

        def weight(f, lag_s=lag * look.sample_s):
            shared = 4 * np.sin(np.pi * f * delay_s) ** 2 if changes["shared"] else 1.0
            return (2 - 2 * np.cos(2 * np.pi * f * lag_s)) * shared

        truth = integral(settings, weight)
        assert np.mean((phases[:, lag:] - phases[:, :-lag]) ** 2) == pytest.approx(truth, rel=0.03)


def test_phase_from_symbol_to_symbol_wanders_as_its_spectrum_says():
    settings = phase_noise.DEFAULTS | {"shared": False, "loop_hz": 300.0}
    look = look_of(network(symbols=400))
    phases = np.stack(
        [phase_noise.phase(settings, look, stream(4, "q", k))[:, 0] for k in range(60)]
    )
    for lag in (1, 3):
        truth = integral(settings, lambda f, lag=lag: 2 - 2 * np.cos(2 * np.pi * f * lag * 2.5e-3))
        assert np.mean((phases[:, lag:] - phases[:, :-lag]) ** 2) == pytest.approx(truth, rel=0.05)


def test_the_slowest_lines_of_a_free_oscillator_wander_over_a_look_as_they_stand():
    """Each line k of amplitude a turns by exp(2 pi j f_k t).

    So D(t) is the sum of a^2 (2 - 2 cos 2 pi f_k t).
    """
    settings = phase_noise.DEFAULTS | {"shared": False, "loop_hz": 0.0}
    radio = network(symbols=400)
    looks = [
        phase_noise.phase(settings, look_of(radio), stream(4, "s", k))[:, 0] for k in range(80)
    ]
    line_hz = np.arange(1, 400) * 0.5
    power = 2 * phase_noise.density(settings, line_hz) * 0.5
    truth = np.sum(power * (2 - 2 * np.cos(2 * np.pi * line_hz * 40 * 2.5e-3)))
    assert np.mean([(look[40:] - look[:-40]) ** 2 for look in looks]) == pytest.approx(
        truth, rel=0.2
    )


def test_a_loop_gives_slow_noise_to_the_reference_and_fast_noise_to_the_oscillator():
    found = 10 * np.log10(phase_noise.density(phase_noise.DEFAULTS, np.array([1.0, 1e6])))
    free = 10 * np.log10(
        phase_noise.density(phase_noise.DEFAULTS | {"loop_hz": 0.0}, np.array([1e6]))
    )
    np.testing.assert_allclose(found, [-46.0, free[0]], atol=0.1)


def test_a_link_has_the_noise_of_two_oscillators():
    settings = phase_noise.DEFAULTS | {"shared": False}
    looks = [look_of(linked(), at) for at in (A, link())]
    own, both = (
        np.var(np.diff(phase_noise.phase(settings, look, stream(4, "l")))) for look in looks
    )
    assert both == pytest.approx(2 * own, rel=1e-6)


def test_one_oscillator_leaves_little_noise_on_near_echoes():
    radio = network(symbols=64)
    near, far = (
        np.var(
            phase_noise.phase(phase_noise.DEFAULTS, look_of(radio, delay_s=delay_s), stream(4, "d"))
        )
        for delay_s in (2e-8, 4e-8)
    )
    assert far == pytest.approx(4 * near, rel=0.2)


def test_the_default_spectrum_is_that_of_the_3gpp_model():
    """The oscillator of TR 38.803, Table 6.1.10-1 (29.55 GHz), moved to 4.9 GHz by 20 log10.

    It has a level, and zeros and poles (Hz) with their powers.
    """
    f = np.geomspace(1, 15e6, 2000)
    level = 32 + 20 * np.log10(4.9 / 29.55)
    for hertz, power in ((3e3, 2.37), (550e3, 2.7), (280e6, 2.53)):
        level = level + 10 * np.log10(1 + (f / hertz) ** power)
    for hertz, power in ((1.0, 3.3), (1.6e6, 3.3), (30e6, 1.0)):
        level = level - 10 * np.log10(1 + (f / hertz) ** power)
    found = 10 * np.log10(phase_noise.density(phase_noise.DEFAULTS | {"loop_hz": 0.0}, f))
    np.testing.assert_allclose(found, level, atol=0.8)
