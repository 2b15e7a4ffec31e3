"""The cheap receiver and its detector, sizes of vehicles, and which windows are simulated."""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_echo import radii, sized
from lowalt.extensions.recordings.twin_receiver import (
    Receiver,
    clipped,
    controlled,
    highpassed,
    quantised,
    received,
    shaped,
)
from lowalt.extensions.recordings.twin_scenes import (
    MARGIN,
    Library,
    clouds_of,
    heard,
    intervals,
    samples,
    stretch,
)
from lowalt.files.errors import InputError
from lowalt.numerics.portable import rms
from lowalt.numerics.streams import stream

QUIET = {
    "snr_db": 80.0,
    "flicker_db": -80.0,
    "flicker_hz": 5.0,
    "wander_db": 0.0,
    "leak_db": -80.0,
    "hum_db": -80.0,
    "hum_hz": 50.0,
}
LOOKING = Twin(24.0e9, "real", 6000.0, 1 / 3000.0, 400, "one_sided", 0.4, 15.0)


@pytest.fixture(scope="module")
def library():
    return Library.read()


def test_the_high_pass_has_half_the_power_at_its_corner_and_falls_by_its_order():
    time = np.arange(60_000) / 6000.0
    for share, wanted in ((1.0, -3.01), (0.1, -40.0), (10.0, 0.0)):
        tone = highpassed(np.cos(2 * np.pi * 100.0 * share * time), 6000.0, 100.0)[30_000:]
        assert 10 * np.log10(2 * np.mean(tone**2)) == pytest.approx(wanted, abs=0.05)
    assert abs(highpassed(np.full(100, 7.0), 6000.0, 100.0)).max() == 0
    values = np.arange(5.0)
    assert highpassed(values, 6000.0, 0.0) is values


def test_levels_are_those_of_what_passes_the_high_pass():
    time = np.arange(60_000) / 6000.0
    slow = np.exp(2j * np.pi * 10.0 * time)
    fast = 0.1 * np.exp(2j * np.pi * 1000.0 * time)
    settings = Receiver.from_settings({**QUIET, "snr_db": 0.0, "highpass_hz": 100.0})
    noise = received(slow + fast, 6000.0, settings, False, np.random.default_rng(0), target=False)
    # The slow part is 40 dB down behind the filter, as strong as a tenth of the fast one.
    assert np.mean(abs(noise) ** 2) == pytest.approx(
        (0.01 + 1e-4) * (1 - 100.0 * 2 / 6000.0), rel=0.05
    )


def test_clipping_limits_and_hum_has_its_harmonics():
    values = np.sin(np.linspace(0, 200 * np.pi, 100_001))
    assert abs(clipped(values, 1.0)).max() == pytest.approx(np.sqrt(0.5), rel=1e-3)
    assert abs(clipped(values + 1j * values, 0.5).imag).max() == pytest.approx(0.5, rel=1e-3)
    time = np.arange(6000) / 6000.0
    settings = Receiver.from_settings({**QUIET, "hum_db": 0.0, "hum_lines": 2.0})
    lines = abs(
        np.fft.rfft(
            received(
                np.exp(2j * np.pi * 700 * time), 6000.0, settings, True, np.random.default_rng(0)
            )
        )
    )
    assert lines[50] / lines[700] == pytest.approx(1.0, rel=1e-3)
    assert lines[100] / lines[50] == pytest.approx(0.5, rel=1e-3)
    assert lines[150] < 1e-3 * lines[50]
    with pytest.raises(InputError, match=r"unknown \['hmu'\]"):
        Receiver.from_settings({**QUIET, "hmu": 1.0})


def test_a_real_channel_records_the_real_part_and_a_complex_one_both():
    wave = np.exp(2j * np.pi * 300.0 * np.arange(4000) / 6000.0)
    heard = {}
    for channel in ("real", "complex"):
        twin = replace(LOOKING, channel=channel)
        heard[channel] = samples(twin, QUIET, wave, np.random.default_rng(0))
        assert abs(samples(twin, QUIET, wave, np.random.default_rng(0), target=False)).max() < 2e-3
    assert np.isrealobj(heard["real"]) and np.iscomplexobj(heard["complex"])
    np.testing.assert_allclose(heard["complex"], wave, atol=2e-3)
    np.testing.assert_allclose(heard["real"], wave.real, atol=2e-3)


def test_a_stretch_is_as_long_as_asked_and_begins_behind_the_margin():
    twin = replace(LOOKING, channel="complex", sampling="bare")
    found = stretch(np.arange(2000.0) + 0j, twin, 0.2)
    # Two samples a symbol: symbol n of the stretch is sample 2 (n + MARGIN).
    np.testing.assert_allclose(found, 2 * (np.arange(600) + MARGIN), atol=1e-6)


def test_simulated_windows_hold_a_target_where_a_receiver_can_hear_it(library):
    scene = {
        **library.scenes["cw_24ghz"]["Vehicle"][1],
        "receiver": {**QUIET, "snr_db": [-60.0, 30.0]},
        "second": {"share": 1.0, "level_db": 0.0},
    }
    clouds = clouds_of(library.records, scene["subtypes"], 1)
    found, names = intervals(LOOKING, scene, clouds, 1, ("here",), 2, 2)
    np.testing.assert_array_equal(found, intervals(LOOKING, scene, clouds, 1, ("here",), 2, 2)[0])
    assert found.shape == (2, 2, 400) and len(names) == 2
    deaf = {**scene, "receiver": {**QUIET, "snr_db": -60.0}}
    quiet, _ = intervals(LOOKING, deaf, clouds, 1, ("here",), 2, 2)
    without, _ = intervals(LOOKING, scene, clouds, 1, ("here",), 2, 2, quiet=True)
    power = np.abs(np.fft.fft(np.stack([found, quiet, without]) * np.hanning(400))) ** 2
    over = power.max(axis=-1) / np.median(power, axis=-1)
    assert (over[0] > 30).all() and (over[1:] < 30).all()


def test_a_second_target_has_its_level_and_a_place_of_its_own(library):
    scene = library.scenes["cw_24ghz"]["Vehicle"][1]
    clouds = clouds_of(library.records, scene["subtypes"], 1)
    alone, both = (
        heard(
            LOOKING,
            {**scene, "second": {"share": share, "level_db": -6.0}},
            clouds,
            stream(1, "scene"),
            0.13,
        )[0]
        for share in (0.0, 1.0)
    )
    second = both - alone
    assert rms(second) / rms(alone) == pytest.approx(10 ** (-6 / 20))
    assert abs(np.vdot(second, alone)) < 0.5 * rms(second) * rms(alone) * len(alone)


def test_a_longer_vehicle_keeps_round_wheels(library):
    cloud = clouds_of(library.records, ["Audi A6L 2019"], 1)["Audi A6L 2019"]
    longer = sized(cloud, [0.5, 2.0, 1.5])
    body = np.isin(cloud.part, cloud.parts_of("body"))
    np.testing.assert_allclose(longer.points[body], cloud.points[body] * [0.5, 2.0, 1.5])
    for wheel in cloud.parts_of("wheel"):
        mine = np.flatnonzero(cloud.part == wheel)
        np.testing.assert_allclose(radii(longer, mine), radii(cloud, mine), atol=1e-12)
        np.testing.assert_allclose(longer.hinges[wheel], cloud.hinges[wheel] * [0.5, 2.0, 1.5])


def test_gain_control_converter_and_slope_of_the_slow_noise():
    time = np.arange(60_000) / 6000.0
    tone = np.cos(2 * np.pi * 500.0 * time) * np.where(time < 5, 1.0, 10.0)
    levels = [
        controlled(tone, 6000.0, share, 0.05)[part].std()
        for share in (0.5, 1.0)
        for part in (slice(12_000, 24_000), slice(48_000, None))
    ]
    # Of 20 dB between weak and strong, the gain leaves the other half, or nothing.
    assert 20 * np.log10(levels[1] / levels[0]) == pytest.approx(10.0, abs=0.2)
    assert 20 * np.log10(levels[3] / levels[2]) == pytest.approx(0.0, abs=0.2)
    assert controlled(tone, 6000.0, 0.0, 0.05) is tone and quantised(tone, 0) is tone
    ramp = np.linspace(-3.0, 3.0, 1001)
    assert (
        len(np.unique(quantised(ramp, 4))) == 17
        and abs(quantised(tone, 8) - tone).max() <= 10 / 2**8 + 1e-12
    )
    pair = quantised(tone + 0.5j * tone, 4)
    np.testing.assert_array_equal(pair.real, quantised(tone, 4))
    powers = []
    for slope in (1.0, 3.0):
        noise = np.fft.fft(shaped(60_000, 6000.0, 5.0, np.random.default_rng(1), slope))
        powers.append([np.mean(abs(noise[place : 2 * place]) ** 2) for place in (1000, 10_000)])
    for (near, far), slope in zip(powers, (1.0, 3.0), strict=True):
        assert np.log10(near / far) == pytest.approx(slope, abs=0.12)
