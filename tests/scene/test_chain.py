"""The chain as a whole: a slow truth within symbols, and laws of what a scene names.

The truth has motion and prefix inside symbols.
"""

from dataclasses import replace

import numpy as np
import pytest

import reference_effects
from linked_routes import link_of, seen_paths
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo import echo_signal
from lowalt.numerics.streams import stream
from lowalt.scene import waveform
from lowalt.scene.chain import SceneSample, received_signal
from lowalt.scene.effects.channel import interference, walls
from lowalt.scene.laws.offsets import of_stations
from lowalt.scene.observe import observe
from lowalt.scene.response import response
from scenes import A, B, network, scene, target, view_of


def data_of(name, radio):
    return waveform.qpsk(
        stream(5, "effect", name, "Thing", 3, "A"), radio.symbols, radio.subcarriers
    )


def sample_of(effects, cloud, row):
    asked = scene(effects)
    return SceneSample(asked, observe(asked, A, cloud, row))


def strongest(responses):
    cells = np.fft.ifft(responses, axis=1)
    return np.take_along_axis(cells, abs(cells).argmax(axis=1)[:, None], axis=1)[:, 0]


def test_motion_inside_a_symbol_is_the_sum_over_every_time_sample():
    radio = network(subcarriers=16, symbols=2, transmit=(2, 2), receive=(2, 2))
    cloud, row = target(np.random.default_rng(7), points=5, rate_hz=500.0)
    asked = scene({"symbol_motion": {}}, radio)
    view = observe(asked, A, cloud, row)
    truth = reference_effects.moving(
        radio,
        A,
        lambda t: view.at(np.array([t])).places,
        cloud.rcs_m2,
        view.aim_m,
        radio.times_s,
        data_of("waveform", radio),
    )
    found = received_signal(asked, A, cloud, row).signal
    assert abs(found - strongest(truth)).max() < 1e-10 * abs(truth).max()
    still = received_signal(scene({}, radio), A, cloud, row).signal
    assert abs(found - still).max() > 1e-3 * abs(still).max()


@pytest.mark.parametrize("prefix_s", [None, 3e-7])
def test_a_late_echo_begins_with_the_previous_symbol(prefix_s):
    radio = network(symbols=3)
    cloud, row = target(np.random.default_rng(1), 3, 20.0, x_m=330.0, rate_hz=0.0)
    asked = scene({"cyclic_prefix": {"prefix_s": prefix_s}}, radio)
    view = observe(asked, A, cloud, row)
    prefix_s = prefix_s or 144 / 2048 / 120e3
    data = data_of("waveform", radio)
    before = data_of("previous waveform", radio)
    count = radio.subcarriers
    baseband = (np.arange(radio.subcarriers) - 16) * 120e3
    truth = np.zeros((3, count), complex)
    for point in range(3):
        places = view.places[:, point : point + 1]
        whole = response(view_of(radio, places, cloud.rcs_m2[point : point + 1], view.aim_m))
        delay_s = 2 * np.linalg.norm(places[:, 0] - A.position_m, axis=1) / SPEED_OF_LIGHT
        for n, i in np.ndindex(3, count):
            t = i / (count * 120e3)
            late = t < delay_s[n] - prefix_s
            sent = before[n] * np.exp(2j * np.pi * baseband * prefix_s) if late else data[n]
            sample = (whole[n] * sent * np.exp(2j * np.pi * baseband * t)).sum() / count
            truth[n] += sample * np.exp(-2j * np.pi * baseband * t) / data[n]
    found = received_signal(asked, A, cloud, row).signal
    assert abs(found - strongest(truth)).max() < 1e-10 * abs(truth).max()
    assert (
        abs(found - received_signal(scene({}, radio), A, cloud, row).signal).max()
        > 0.1 * abs(found).max()
    )


def test_an_early_signal_ends_with_the_prefix_of_the_next_symbol():
    radio = network(symbols=3)
    rng = np.random.default_rng(4)
    count = radio.subcarriers
    frequencies = (np.arange(radio.subcarriers) - 16) * 120e3
    whole = rng.normal(size=(3, count)) + 1j * rng.normal(size=(3, count))
    early = 5
    prefix_s = 0.6e-6
    found = waveform.windowed(radio, prefix_s, whole, -early, lambda name: data_of(name, radio))
    for n, i in np.ndindex(3, count):
        t = i / (count * 120e3)
        # The next symbol's prefix is the end of its useful part: its time starts a prefix earlier.
        late = i >= count - early
        sent = data_of("next waveform", radio)[n] if late else data_of("waveform", radio)[n]
        shift_s = t - prefix_s if late else t
        sample = (whole[n] * sent * np.exp(2j * np.pi * frequencies * shift_s)).sum() / count
        assert found[n, i] == pytest.approx(sample)


def test_other_stations_are_heard_from_mast_to_mast_and_leak_by_their_levels():
    cloud, row = target(np.random.default_rng(5))
    shared = replace(B, frequency_hz=A.frequency_hz)

    def unknown(stations, **changes):
        """What station A hears of the others."""
        asked = scene(
            {"interference": {"sigma_ppm": 0.0, "sigma_s": 0.0, **changes}},
            network(stations=stations),
        )
        return interference.heard(
            asked.effects[0].settings, SceneSample(asked, observe(asked, A, cloud, row))
        )

    alone, weak, full = (unknown((A, shared), loss_db=loss) for loss in (400.0, 20.0, 0.0))
    assert abs(alone).max() > 0
    np.testing.assert_allclose(full - alone, 10 * (weak - alone), atol=1e-12 * abs(full).max())
    # B's sub-band does not overlap with A's: only its leakage is heard.
    leaked, less = (unknown((A, B), leakage_db=level) for level in (45.0, 55.0))
    np.testing.assert_allclose(leaked, np.sqrt(10) * less, rtol=1e-12)
    at_level = np.mean(abs(unknown((A, B), leakage_db=0.0)) ** 2)
    assert at_level == pytest.approx(np.mean(abs(full) ** 2), rel=0.1)


@pytest.mark.parametrize(("model", "beside"), [(3, "next waveform"), (9, "previous waveform")])
def test_another_station_is_heard_by_its_own_clock_and_oscillator(model, beside):
    """Every time sample from what its sender has on the air by then.

    That is the symbol, the one before or the one after.
    """
    shared = replace(B, frequency_hz=A.frequency_hz)
    radio, (cloud, row) = (
        network(symbols=3, stations=(A, shared)),
        target(np.random.default_rng(5), model=model),
    )
    asked = scene({"interference": {"sigma_ppm": 0.5, "sigma_s": 1e-6}}, radio)
    settings = asked.effects[0].settings
    sample = SceneSample(asked, observe(asked, A, cloud, row))
    errors = of_stations(settings, radio, asked.stream("link_offset", row))
    ppm, shift_s = np.subtract(errors["B"], errors["A"])
    data = interference.sent(settings, sample, shared)
    frequencies = (np.arange(32) - 16) * 120e3
    truth = np.zeros((3, 32), complex)
    seen = set()
    for whole, delay_s in interference.arrivals(settings, sample, shared):
        for n, i in np.ndindex(3, 32):
            t = i / (32 * 120e3)
            sent_s = t - delay_s - shift_s
            name = "waveform"
            after_s = 0.0
            if sent_s < -sample.prefix_s:
                name = "previous waveform"
                after_s = sample.prefix_s
            if sent_s >= 1 / 120e3:
                name = "next waveform"
                after_s = -sample.prefix_s
            seen.add(name)
            wave = np.exp(2j * np.pi * frequencies * (t - shift_s + after_s)) * data(name)[n]
            instant = n * radio.symbol_interval_s + t
            turn = np.exp(2j * np.pi * 1e-6 * ppm * (A.frequency_hz + 16 * 120e3) * instant)
            truth[n, i] += turn * (np.broadcast_to(whole, (3, 32))[n] * wave).sum() / 32
    assert seen == {"waveform", beside}
    np.testing.assert_allclose(
        interference.heard(settings, sample), truth, atol=1e-9 * abs(truth).max()
    )


FACADES = {
    "facades": [
        [-30.0, 6.0, 0.0, 8.0, 40.0],
        [36.0, 80.0, 270.0, 20.0, 60.0],
        [50.0, -30.0, 90.0, 300.0, 60.0],
    ]
}


def test_on_a_link_every_path_out_meets_every_path_back():
    """Both ends see unlike numbers of paths: A sees all of three facades, B one."""
    assert seen_paths(link_of({"walls": FACADES}), walls, FACADES) == [3, 1]


@pytest.mark.parametrize("effects", [{}, {"mean_cross_section": {}}])
def test_the_signal_of_a_target_alone_is_the_echo_engines_to_the_last_bit(effects):
    cloud, row = target(np.random.default_rng(2))
    asked = scene(effects)
    found = received_signal(asked, A, cloud, row)
    view = observe(asked, A, cloud, row)
    assert (view.cloud.rcs_m2 == cloud.rcs_m2).all() == (not effects)
    engine = echo_signal(network(), A, view.motion, view.cloud.rcs_m2, view.aim_m)
    np.testing.assert_array_equal(found.signal, engine.signal)


def test_effects_without_strength_change_no_bit():
    cloud, row = target(np.random.default_rng(3))
    idle = {
        "gusts": {"wind_mps": 0.0},
        "iq_imbalance": {"gain_db": 0.0, "phase_deg": 0.0},
        "adc": {"bits": None},
        "clutter": {"gamma": 0.0},
        "canceller": {"kind": "none"},
        "timing_offset": {"sigma_s": 0.0},
    }
    np.testing.assert_array_equal(
        received_signal(scene(idle), A, cloud, row).signal,
        received_signal(scene({}), A, cloud, row).signal,
    )


def test_adding_an_effect_moves_no_other_draw():
    cloud, row = target(np.random.default_rng(4))
    noise = {"receiver_noise": {"noise_figure_db": 60.0}}
    land = {"clutter": {}}
    noisy, cluttered, both = (
        sample_of(effects, cloud, row) for effects in (noise, land, noise | land)
    )
    echo = np.fft.ifft(noisy.direct, axis=1)
    assert (
        abs((both.cells - cluttered.cells) - (noisy.cells - echo)).max()
        < 1e-9 * abs(noisy.cells).max()
    )
    assert abs(noisy.cells - echo).max() > 0.1 * abs(echo).max()


def test_sampling_and_carrier_come_of_one_oscillator():
    row = target(np.random.default_rng(1))[1]
    asked = scene({"clock_offset": {}, "carrier_offset": {}, "timing_offset": {}})
    drawn = [
        asked.drawn(row, A, name).random()
        for name in ("clock_offset", "carrier_offset", "timing_offset")
    ]
    assert (
        drawn[0] == drawn[1] != drawn[2]
        and drawn[0] != asked.drawn(row, B, "clock_offset").random()
    )


@pytest.mark.parametrize("noise", [{"receiver_noise": {}}, {"cell_noise": {"snr_db": 3.0}}])
def test_a_sample_without_its_target_keeps_its_noise_and_land(noise):
    cloud, row = target(np.random.default_rng(6))
    whole, echo = (
        sample_of(effects, cloud, row) for effects in (noise | {"clutter": {}}, {"squint": {}})
    )
    empty = whole.without_target()
    difference = whole.cells - empty.cells
    alone = np.fft.ifft(echo.direct, axis=1)
    assert abs(difference - alone).max() < 1e-9 * abs(whole.cells).max()


def test_noise_at_an_snr_of_zero_has_a_stream_of_its_own():
    """A level of 0 dB is a level.

    Its draws are those neither of 3 dB nor of an effect without a level.
    """
    row = {"subtype": "a", "model": 0}
    asked = scene({"cell_noise": {"snr_db": 0.0}}, network())
    zero = asked.stream("cell_noise", row).random()
    assert zero != asked.at_snr(3.0).stream("cell_noise", row).random()
    assert zero != asked.at_snr(None).stream("cell_noise", row).random()
    # No other effect's stream follows the SNR.
    other = asked.stream("phase_noise", row).random()
    assert other == asked.at_snr(3.0).stream("phase_noise", row).random()
