"""Slow time as frames have it: gaps, missing and late symbols, and signals made even again."""

from dataclasses import replace

import numpy as np
import pytest

from effects_frames import network as plain_network
from lowalt.common.errors import InputError
from lowalt.echo import echo_signal
from lowalt.effects.catalogue import called
from lowalt.effects.checks import CheckedScene
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.transmitter import slow_time
from lowalt.effects.transmitter.slow_time import Sampling
from test_effects import network, target

RADIO = plain_network(400, 64)
PLAIN = {"tdd_period_s": 0.01, "downlink": 1.0, "missing": 0.0, "jitter_s": 0.0, "regrid": "zero"}


def sampled(seed=1, **given):
    return slow_time.sampling({**PLAIN, **given}, RADIO, np.random.default_rng(seed))


def spectrum(given, at, hertz):
    """Magnitude spectrum (N,) of a line of unit amplitude, received at the instants `at`, made even again."""
    signal = np.exp(2j * np.pi * hertz * at.times_s[at.present])
    return abs(np.fft.fft(slow_time.regridded({**PLAIN, **given}, signal, at, RADIO))) / 400


def test_downlink_opens_every_period():
    at = sampled(downlink=0.75)
    assert (at.present.reshape(-1, 4) == [True, True, True, False]).all()
    assert (at.times_s == RADIO.times_s).all()
    half = sampled(tdd_period_s=0.02, downlink=0.5)
    assert (half.present.reshape(-1, 8) == ([True] * 4 + [False] * 4)).all()


def test_gaps_repeat_a_line_at_multiples_of_the_tdd_rate():
    at = sampled(downlink=0.75)
    lines = spectrum({}, at, 20.0)
    # The window 1110 has Fourier coefficients (1 + z + z^2) / 4, z a fourth root of one.
    for order, height in enumerate((0.75, 0.25, 0.25, 0.25)):
        assert lines[(20 + 100 * order) % 400] == pytest.approx(height)
    assert np.sort(lines)[-5] < 1e-12


def test_missing_symbols_raise_a_floor_of_their_share():
    at = sampled(missing=0.2)
    share = at.present.mean()
    assert share == pytest.approx(0.8, abs=0.06)
    lines = spectrum({}, at, 30.0)
    assert lines[30] == pytest.approx(share)
    assert np.sum(np.delete(lines, 30) ** 2) == pytest.approx(share * (1 - share))


@pytest.mark.parametrize("hertz", [20.0, 150.0])
def test_late_symbols_cost_a_line_its_characteristic_function(hertz):
    late = 2.4e-3
    at = sampled(jitter_s=late)
    assert (at.times_s - RADIO.times_s).min() >= 0 and (at.times_s - RADIO.times_s).max() < late
    # Jitter uniform over `late` leaves the amplitude sinc(f late).
    assert spectrum({}, at, hertz)[int(hertz)] == pytest.approx(abs(np.sinc(hertz * late)), abs=0.05)
    # A transform that knows the instants leaves all of it.
    assert spectrum({"regrid": "nudft"}, at, hertz)[int(hertz)] == pytest.approx(1.0)


def test_a_transform_of_even_instants_is_the_plain_one():
    at, rng = sampled(), np.random.default_rng(3)
    signal = rng.standard_normal((400, 2)) @ [1, 1j]
    for kind in slow_time.REGRIDS:
        found = slow_time.regridded({**PLAIN, "regrid": kind}, signal, at, RADIO)
        np.testing.assert_allclose(found, signal, atol=1e-11)


def test_gaps_are_held_or_bridged():
    at = Sampling(RADIO.times_s, np.arange(400) % 4 < 2)
    ramp = (1 + 2j) * np.arange(400.0)
    bridged = slow_time.regridded({**PLAIN, "regrid": "linear"}, ramp[at.present], at, RADIO)
    np.testing.assert_allclose(bridged[:397], ramp[:397], rtol=1e-12)
    held = slow_time.regridded({**PLAIN, "regrid": "hold"}, ramp[at.present], at, RADIO)
    np.testing.assert_array_equal(held, ramp[np.arange(400) - np.maximum(np.arange(400) % 4 - 1, 0)])


def test_the_chain_hears_the_target_at_its_true_instants():
    cloud, row = target(np.random.default_rng(2))
    radio = network(symbols=24)
    given = {"tdd_period_s": 0.01, "downlink": 0.75, "jitter_s": 1e-3}
    effects = tuple(called({"slow_time": given}))
    station, scene = radio.stations[0], Scene(radio, 5, None, effects)
    found = received_signal(scene, station, cloud, row)
    at = effects[0].module.sampling(effects[0].settings, radio, scene.stream("slow_time", row, "A"))
    assert (found.signal[~at.present] == 0).all() and (found.cell[~at.present] == -1).all()
    assert at.present.sum() == 18 and (found.cell[at.present] >= 0).all()
    # The engine at the same instants, one symbol after the other.
    view = replace(observe(Scene(radio, 5, None, ()), station, cloud, row), times_s=at.times_s)
    truth = echo_signal(radio, station, view.motion, cloud.rcs_m2, view.aim_m).signal
    assert abs(found.signal - truth)[at.present].max() < 1e-10 * abs(truth).max()


def test_a_canceller_works_on_received_symbols_alone():
    cloud, row = target(np.random.default_rng(2))
    radio = network(symbols=24, place=(0.0, 0.0, 10.0))
    given = {"slow_time": {"downlink": 0.5}, "clutter": {"gamma": 1e4, "wind_mps": 0.0}, "canceller": {"kind": "mean"}}
    found = received_signal(Scene(radio, 5, None, tuple(called(given))), radio.stations[0], cloud, row)
    # Still land of any strength is gone, where a mean over zeros would have left half of it.
    weak = received_signal(Scene(radio, 5, None, tuple(called({**given, "clutter": {"gamma": 1e-6, "wind_mps": 0.0}}))),
                radio.stations[0], cloud, row)  # fmt: skip
    assert abs(found.signal - weak.signal).max() < 1e-6 * abs(weak.signal).max()


@pytest.mark.parametrize(
    ("given", "snrs", "words"),
    [
        ({"jitter_s": 2.5e-3}, (), "jitter_s"),
        ({"tdd_period_s": 2.0, "downlink": 0.001}, (), "fewer than 2"),
        ({"downlink": 0.5}, (3.0,), "receiver_noise"),
    ],
)
def test_impossible_frames_are_refused(given, snrs, words):
    with pytest.raises(InputError, match=words):
        slow_time.check({**PLAIN, **given}, CheckedScene(RADIO, {}, snrs))
