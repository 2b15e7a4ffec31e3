"""What a station sends: QAM data, a saturating amplifier, combs of pilots, and its own signal in its receiver."""

import numpy as np
import pytest

from effects_frames import frame, point, received
from effects_frames import network as plain_network
from lowalt.common.errors import InputError
from lowalt.echo import echo_matrix
from lowalt.effects import waveform
from lowalt.effects.catalogue import called
from lowalt.effects.checks import CheckedScene
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.receiver import adc, receiver_noise, transmit_leakage
from lowalt.effects.sending import Sending
from lowalt.effects.transmitter import comb_pilots, data_symbols, power_amplifier
from test_effects import network, target


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def sending(effects, radio=None, seed=3):
    """What a station sends; every stream of the same seed and its name."""
    draws = lambda name: np.random.default_rng([seed, len(name)])  # noqa: E731
    return Sending(called(effects), radio or plain_network(40, 64), draws)


def scene(effects, radio=None, tolerance=None):
    return Scene(radio or network(), 5, tolerance, tuple(called(effects)))


# Data


@pytest.mark.parametrize(("order", "rise_db"), [(4, 0.0), (16, 2.76), (64, 4.29)])
def test_division_by_the_symbol_raises_noise_as_the_constellation_says(order, rise_db):
    assert 10 * np.log10(data_symbols.noise_rise(order)) == pytest.approx(rise_db, abs=0.005)
    assert np.mean(abs(data_symbols.constellation(order)) ** 2) == pytest.approx(1.0)
    assert len(set(np.round(data_symbols.constellation(order), 12))) == order


def test_16_qam_has_2_8_db_more_noise_than_qpsk_after_the_receiver(rng):
    radio = plain_network(300, 64)
    settings, power = receiver_noise.DEFAULTS, {}
    for name, effects in (("qpsk", {}), ("qam", {"data_symbols": {"order": 16}})):
        air = sending(effects, radio)
        samples = waveform.transmit(np.zeros((300, 64)), air.aired)
        noisy = receiver_noise.receive(settings, samples, waveform.Frame(radio, radio.stations[0], air.known), rng)
        power[name] = np.mean(abs(air.received(noisy, slice(None))) ** 2)
    # Estimates of 19200 values each; the rise of 16-QAM is (4/16) 5 + (8/16) + (4/16) 5/9.
    assert power["qam"] / power["qpsk"] == pytest.approx(1.25 + 0.5 + 0.25 * 5 / 9, rel=0.04)
    assert power["qpsk"] == pytest.approx(receiver_noise.variance(settings, 120e3), rel=0.03)


def test_qam_without_noise_is_the_echo_itself(rng):
    cloud, row = target(rng)
    station = network().stations[0]
    plain = received_signal(scene({}), station, cloud, row)
    # An imperfect mixer makes the chain send the data; one so slight changes nothing else.
    slight = {"data_symbols": {"order": 256}, "iq_imbalance": {"gain_db": 1e-13, "phase_deg": 0.0}}
    mixed = received_signal(scene(slight), station, cloud, row)
    assert abs(mixed.signal - plain.signal).max() < 1e-11 * abs(plain.signal).max()
    assert data_symbols.amplifies({"order": 16}) == pytest.approx(3.0)


def test_an_order_without_a_square_is_refused():
    with pytest.raises(InputError, match="order: 32"):
        data_symbols.check({"order": 32}, CheckedScene(network(), {}, ()))


# Amplifier


@pytest.mark.parametrize("count", [12, 256])
@pytest.mark.parametrize("smoothness", [2.0, 3.0])
def test_a_saturated_waveform_is_that_of_the_time_signal_summed_directly(rng, count, smoothness):
    settings = {"backoff_db": 2.0, "smoothness": smoothness}
    sent = waveform.sent(rng, 3, count)
    over = power_amplifier.OVERSAMPLING
    t = np.arange(over * count) / (over * count)
    tones = np.exp(2j * np.pi * np.outer(np.arange(count) - count // 2, t))
    signal = sent @ tones
    limit = np.sqrt(count) * 10**0.1
    loud = signal / (1 + (abs(signal) / limit) ** (2 * smoothness)) ** (0.5 / smoothness)
    truth = loud @ tones.conj().T / (over * count)
    np.testing.assert_allclose(power_amplifier.aired(settings, sent), truth, atol=1e-13)


def test_products_of_seven_subcarriers_fold_from_nowhere_into_the_band(rng):
    """Smoothness 3 makes products of seven; they span seven bands, and the nearest image of the band is four away."""
    settings, count, over = {"backoff_db": 20.0, "smoothness": 3.0}, 12, 16
    sent = waveform.sent(rng, 8, count)
    tones = np.exp(2j * np.pi * np.outer(np.arange(count) - count // 2, np.arange(over * count) / (over * count)))
    signal = sent @ tones
    weaker = signal / (1 + (abs(signal) / (np.sqrt(count) * 10)) ** 6) ** (1 / 6) - signal
    truth = weaker @ tones.conj().T / (over * count)
    np.testing.assert_allclose(power_amplifier.aired(settings, sent) - sent, truth, atol=1e-5 * abs(truth).max())


@pytest.mark.parametrize("backoff_db", [0.0, 3.0, 6.0])
def test_a_hard_limiter_has_the_equivalent_gain_and_distortion_of_a_gaussian(rng, backoff_db):
    gaussian = (rng.standard_normal((400_000, 2)) @ [1, 1j]) * np.sqrt(0.5)
    out = power_amplifier.rapp(gaussian, 10 ** (backoff_db / 20), 60.0)
    gain, distortion = power_amplifier.soft_limit(backoff_db)
    assert np.mean(out * gaussian.conj()).real == pytest.approx(gain, abs=4e-3)
    assert np.mean(abs(out - gain * gaussian) ** 2) == pytest.approx(distortion, rel=0.03)


def test_an_ofdm_signal_is_compressed_like_a_gaussian(rng):
    sent = waveform.sent(rng, 60, 256)
    aired = power_amplifier.aired({"backoff_db": 3.0, "smoothness": 60.0}, sent)
    gain, distortion = power_amplifier.soft_limit(3.0)
    found = np.mean(aired * sent.conj())
    assert found == pytest.approx(gain, abs=4e-3)
    # Part of the distortion falls outside the band; the rest stays.
    left = np.mean(abs(aired - found * sent) ** 2)
    assert 0.4 * distortion < left < 0.95 * distortion


def test_a_weak_signal_is_not_compressed_and_no_signal_grows(rng):
    sent = waveform.sent(rng, 20, 64)
    faint = power_amplifier.aired({"backoff_db": 100.0, "smoothness": 2.0}, sent)
    assert abs(faint - sent).max() < 1e-9
    hard = power_amplifier.aired({"backoff_db": -3.0, "smoothness": 5.0}, sent)
    assert (np.linalg.norm(hard, axis=1) <= np.linalg.norm(sent, axis=1)).all()
    assert abs(power_amplifier.rapp(np.array([1e9 + 1e9j]), 0.5, 2.0))[0] == pytest.approx(0.5)


def test_echoes_are_those_of_the_amplified_waveform(rng):
    cloud, row = target(rng)
    station = network().stations[0]
    plain, effects = scene({}), {"power_amplifier": {"backoff_db": 1.0}}
    loud = received_signal(scene(effects), station, cloud, row)
    view = observe(plain, station, cloud, row)
    response = echo_matrix(network(), station, view.motion, cloud.rcs_m2, view.aim_m, "subcarriers")
    known = waveform.sent(plain.stream("waveform", row, "A"), 24, 32)
    truth = np.fft.ifft(response * power_amplifier.aired({"backoff_db": 1.0, "smoothness": 2.0}, known) / known, axis=1)
    best = abs(truth).argmax(axis=1)
    assert (loud.cell == best).all()
    assert abs(loud.signal - truth[np.arange(24), best]).max() < 1e-12 * abs(truth).max()


# Pilots


@pytest.mark.parametrize(("spacing", "offset"), [(2, 0), (4, 3), (8, 5)])
def test_a_comb_sees_the_sum_of_the_cells_that_fold_together(rng, spacing, offset):
    response = rng.standard_normal((5, 32)) + 1j * rng.standard_normal((5, 32))
    given = {"spacing": spacing, "offset": offset}
    whole = np.fft.ifft(response, axis=1).reshape(5, spacing, -1)
    turn = np.exp(2j * np.pi * offset * np.arange(spacing) / spacing)[:, None]
    # Cell r + q M / K of the whole band turns from tooth to tooth by 2 pi q / K, and folds with that phase.
    np.testing.assert_allclose(comb_pilots.range_cells(given, response), (whole * turn.conj()).sum(axis=1), atol=1e-13)


def test_a_comb_keeps_an_echo_in_its_cell_and_has_more_noise(rng):
    look = frame(plain_network(50, 64))
    cells = comb_pilots.range_cells({"spacing": 4, "offset": 1}, point(look, 5.0))
    assert (abs(cells).argmax(axis=1) == 5).all() and cells.shape == (50, 16)
    np.testing.assert_allclose(cells[:, 5], 1.0, atol=1e-12)
    noise = rng.standard_normal((50, 64)) + 1j * rng.standard_normal((50, 64))
    rise = np.mean(abs(comb_pilots.range_cells({"spacing": 4, "offset": 0}, noise)) ** 2)
    assert rise / np.mean(abs(np.fft.ifft(noise, axis=1)) ** 2) == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize(("given", "word"), [((5, 0), "divisor"), ((32, 0), "divisor"), ((4, 4), "offset")])
def test_an_impossible_comb_is_refused(given, word):
    with pytest.raises(InputError, match=word):
        comb_pilots.check(dict(zip(("spacing", "offset"), given, strict=True)), CheckedScene(network(), {}, ()))


def test_echoes_through_a_comb_are_those_of_its_subcarriers(rng):
    cloud, row = target(rng)
    station = network().stations[0]
    found = received_signal(scene({"comb_pilots": {"spacing": 2}}), station, cloud, row)
    plain = received_signal(scene({}), station, cloud, row)
    assert (found.cell == plain.cell % 16).all()
    assert abs(found.signal - plain.signal).max() < 0.1 * abs(plain.signal).max()


# Leakage


def test_leakage_stands_in_the_first_cell_at_its_level():
    look = frame(plain_network(30, 64))
    found = np.fft.ifft(received(transmit_leakage, {"isolation_db": 40.0}, look, np.zeros((30, 64))), axis=1)
    np.testing.assert_allclose(found[:, 0], found[0, 0], atol=1e-14)
    assert abs(found[0, 0]) == pytest.approx(0.01) and abs(found[:, 1:]).max() < 1e-15
    late = {"isolation_db": 40.0, "delay_s": 2 / (64 * 120e3)}
    found = np.fft.ifft(received(transmit_leakage, late, look, np.zeros((30, 64))), axis=1)
    assert (abs(found).argmax(axis=1) == 2).all()


def test_a_canceller_removes_leakage_but_not_the_converters_noise_that_it_brings(rng):
    look = frame(plain_network(200, 64), delay_s=1e-6)
    echo = 1e-4 * point(look, 9.0, 30.0)
    left = {}
    for name, isolation in (("none", None), ("leaky", 20.0)):
        samples = waveform.transmit(echo, look.sent)
        if isolation:
            settings = {"isolation_db": isolation, "delay_s": 0.0}
            samples = transmit_leakage.receive(settings, samples, look, np.random.default_rng(2))
        exact = waveform.demodulate(samples, look.sent)
        rough = adc.receive({"bits": 10, "backoff_db": 12.0, "clip": True}, samples, look, rng)
        left[name] = np.mean(abs(waveform.demodulate(rough, look.sent) - exact) ** 2)
        moving = np.fft.ifft(exact - exact.mean(axis=0), axis=1)
        assert (abs(moving).argmax(axis=1) == 9).all()
    # Quantisation noise follows the power before the converter: 60 dB from the echo alone to the leakage.
    assert 10 * np.log10(left["leaky"] / left["none"]) == pytest.approx(60.0, abs=0.5)


@pytest.mark.parametrize("other", [{"carrier_offset": {}}, {"phase_noise": {"shared": False}}])
def test_leakage_through_another_oscillator_is_refused(other):
    with pytest.raises(InputError, match="transmit_leakage"):
        transmit_leakage.check(transmit_leakage.DEFAULTS, CheckedScene(network(), other, ()))


# By need


@pytest.mark.parametrize(
    "sent", [{"data_symbols": {"order": 64}}, {"comb_pilots": {"spacing": 4}}, {"power_amplifier": {"backoff_db": 0.0}}]
)
@pytest.mark.parametrize("tolerance", [0.3, 1e-2])
def test_whatever_is_left_out_keeps_the_tolerance_with_these_too(rng, sent, tolerance):
    cloud, row = target(rng, points=3, size_m=0.1, wheel_hz=10.0)
    row |= {"x_m": 300.0}
    given = {**sent, "iq_imbalance": {}, "squint": {}, "wavefront": {}, "symbol_motion": {}}
    station = network().stations[0]
    full = received_signal(scene(given), station, cloud, row)
    some = received_signal(scene(given, tolerance=tolerance), station, cloud, row)
    assert abs(some.signal - full.signal).max() <= tolerance * abs(full.signal).max()
    if tolerance == 0.3:
        assert any(not decision.computed for decision in some.decisions)
