"""Receiver effects: each setting is read back from the signal, against closed forms and slow sums."""

import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml

from effects_frames import frame, network, point, received
from lowalt.effects import waveform
from lowalt.effects.catalogue import ORDER, called
from lowalt.effects.receiver import (
    adc,
    carrier_offset,
    clock_offset,
    iq_imbalance,
    phase_noise,
    receiver_noise,
    timing_offset,
    transmit_leakage,
)

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


@pytest.mark.parametrize("effect", [timing_offset, transmit_leakage])
def test_an_effect_on_the_response_is_that_on_the_samples(effect):
    look = frame(network(subcarriers=64, symbols=20), seed=4)
    rng = np.random.default_rng(8)
    response = rng.standard_normal((20, 128)).view(np.complex128)
    drawn = [np.random.default_rng(5), np.random.default_rng(5)]
    settings_of = effect.DEFAULTS | ({"isolation_db": 10.0, "delay_s": 3e-7} if effect is transmit_leakage else {})
    samples = effect.receive(settings_of, waveform.transmit(response, look.waveform), look, drawn[0])
    changed = effect.respond(settings_of, response, look, drawn[1])
    assert abs(changed - response).max() > 1e-3
    np.testing.assert_allclose(waveform.transmit(changed, look.waveform), samples, rtol=0, atol=1e-13)
    assert drawn[0].random() == drawn[1].random()
