"""Responses whose data are put on within the next compiled pass, without an array of tones."""

from dataclasses import replace

import numpy as np
import pytest

from effects_frames import frame
from lowalt.common.streams import stream
from lowalt.effects import receiving, waveform
from lowalt.effects.catalogue import called, providing
from test_effects import network

EFFECTS = {"clock_offset": {"fixed_ppm": 3.0}, "carrier_offset": {"fixed_ppm": 3.0}, "phase_noise": {"shared": False}}


def carried(symbols, subcarriers):
    """Responses and data (N, M)."""
    rng = np.random.default_rng(5)
    responses = rng.normal(size=(symbols, subcarriers)) + 1j * rng.normal(size=(symbols, subcarriers))
    return responses, waveform.sent(stream(1, "waveform"), symbols, subcarriers)


@pytest.mark.parametrize("subcarriers", [32, 9, 256])
@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_begins_with_responses_and_their_data_as_with_their_tones(name, subcarriers):
    look, effect = frame(network(subcarriers=subcarriers, symbols=9)), called({name: EFFECTS[name]})[0]
    responses, data = carried(9, subcarriers)
    kept = responses.copy()
    truth = effect.module.retoned(effect.settings, waveform.tones_of(responses, data), look, stream(6, name))
    both = waveform.carrying(responses, data)
    found = effect.module.retoned_responses(effect.settings, both, look, stream(6, name))
    np.testing.assert_array_equal(found, truth)
    np.testing.assert_array_equal(responses, kept)
    assert abs(found - waveform.tones_of(responses, data)).max() > 1e-6


@pytest.mark.parametrize("subcarriers", [32, 256])
def test_phase_noise_of_a_look_that_is_computed_again_is_that_of_the_first_time(subcarriers):
    look, effect = frame(network(subcarriers=subcarriers, symbols=9)), called({"phase_noise": {"shared": False}})[0]
    both = waveform.carrying(*carried(9, subcarriers))
    once = effect.module.retoned_responses(effect.settings, both, look, stream(6, "phase"))
    look = replace(look, drawn={})
    for draws in (stream(6, "phase"), stream(7, "phase")):
        found = effect.module.retoned_responses(effect.settings, both, look, draws)
        np.testing.assert_array_equal(found, once)


@pytest.mark.parametrize("subcarriers", [8, 9, 256])
def test_samples_of_responses_are_those_of_their_tones(subcarriers):
    responses, data = carried(4, subcarriers)
    expected = np.fft.ifft(np.fft.ifftshift(responses * data, axes=1), axis=1)
    np.testing.assert_allclose(waveform.transmit(responses, data), expected, rtol=0, atol=1e-15)
    same = waveform.transmit(responses[:1], data), waveform.transmit(np.tile(responses[:1], (4, 1)), data)
    np.testing.assert_array_equal(*same)


@pytest.mark.parametrize("subcarriers", [32, 256])
@pytest.mark.parametrize("settings", [{}, {"bits": 3}, {"bits": 3, "clip": False, "backoff_db": 0.0}])
def test_a_converter_makes_the_tones_of_its_samples(settings, subcarriers):
    look, effect = frame(network(subcarriers=subcarriers, symbols=9)), called({"adc": settings})[0]
    samples = waveform.transmit(*carried(9, subcarriers))
    truth = np.fft.fft(effect.module.receive(effect.settings, samples, look, stream(6, "adc")), axis=1)
    found = effect.module.toned(effect.settings, samples, look, stream(6, "adc"))
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-14 * subcarriers * abs(samples).max())
    assert abs(found - np.fft.fft(samples, axis=1)).max() > 1e-5 * abs(truth).max()
    assert not effect.module.toned(effect.settings, 0 * samples, look, stream(6, "adc")).any()
    tones = np.fft.fft(samples, axis=1)
    found = effect.module.retoned(effect.settings, tones.copy(), look, stream(6, "adc"))
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-14 * subcarriers * abs(samples).max())
    assert not effect.module.retoned(effect.settings, 0 * tones, look, stream(6, "adc")).any()


NO_DATA = "phase_noise", "clock_offset", "carrier_offset", "timing_offset", "iq_imbalance", "adc"


@pytest.mark.parametrize("name", NO_DATA)
def test_effects_that_need_no_data_do_the_same_whatever_the_frame_s_data(name):
    given = {"shared": False} if name == "phase_noise" else {}
    effect, samples = called({name: given})[0], waveform.transmit(*carried(9, 256))
    assert providing([effect], receiving.NeedsNoData)
    look = frame(network(subcarriers=256, symbols=9))
    bare = replace(look, sent=np.broadcast_to(np.ones((), np.complex128), look.sent.shape))
    found = [effect.module.receive(effect.settings, samples.copy(), one, stream(6, name)) for one in (look, bare)]
    np.testing.assert_array_equal(*found)
    assert abs(found[0] - samples).max() > 1e-9 * abs(samples).max()


def test_effects_that_draw_nothing_leave_their_generator_as_it_is():
    look, draws = frame(network(subcarriers=256, symbols=9)), receiving.UNUSED
    before, samples = draws.bit_generator.state, waveform.transmit(*carried(9, 256))
    effects = called({"adc": {}, "phase_noise": {}, "carrier_offset": {}, "iq_imbalance": {}})
    found = providing(effects, receiving.DrawsNothing)
    assert {one.name for one in found} == {"adc", "iq_imbalance"}
    for one in found:
        one.module.receive(one.settings, samples, look, draws)
        one.module.retoned(one.settings, np.fft.fft(samples, axis=1), look, draws)
    assert draws.bit_generator.state == before
