"""Land clutter: its power by closed forms and sums over patches, its amplitude laws and its Doppler spectrum."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.special import gamma, kv

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.effects.channel import clutter, windblown
from lowalt.effects.response import response
from test_effects_channel import NETWORK, body, seen


def settings_of(**change) -> dict:
    """Settings of the clutter with some changed."""
    return {**clutter.DEFAULTS, **change}


def test_land_has_the_closed_power_of_its_rings():
    network = replace(NETWORK, transmit=(1, 1), receive=(1, 1))
    station = network.station("A")
    found = clutter.cell_power(settings_of(reach_m=1000.0), network, station, np.array([200.0, 100.0, 60.0]))
    cell, height = network.cell_m, 25.0
    edges = np.clip((np.arange(len(found))[:, None] + [-0.25, 0.75]) * cell, height, 1000.0)
    # sigma0 r dr dphi / r^4 with sigma0 = gamma h / r, all around.
    rings = 2 * np.pi * 0.03 * height / 3 * (edges[:, 0] ** -3 - edges[:, 1] ** -3)
    np.testing.assert_allclose(found, radar(network, station).scale ** 2 * rings, rtol=1e-6, atol=1e-30)


def test_land_under_both_beams_matches_a_sum_over_patches():
    station = NETWORK.station("B")
    aim = np.array([300.0, 150.0, 40.0])
    found = clutter.cell_power(settings_of(reach_m=400.0), NETWORK, station, aim)
    radio = radar(NETWORK, station)
    place = np.array(station.position_m)
    radius = (np.arange(24) + 0.5) / 24
    azimuth = 2 * np.pi * np.arange(2000) / 2000
    normal = np.array([np.cos(station.normal_rad), np.sin(station.normal_rad), 0.0])
    side = np.array([-normal[1], normal[0], 0.0])
    for cell in (7, 30, 77):
        r = (cell - 0.25 + radius[:, None]) * NETWORK.cell_m
        flat = np.sqrt(r**2 - place[2] ** 2)
        away = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), -place[2] + 0 * flat * azimuth], -1)
        to_aim = (aim - place) / np.linalg.norm(aim - place)
        angle = np.pi * radio.kappa
        unit = away / r[..., None]
        phases = [np.exp(1j * angle * np.arange(16)[:, None, None] * ((unit - to_aim) @ side)).sum(axis=0),
                  np.exp(1j * angle * np.arange(4)[:, None, None] * (unit - to_aim)[..., 2]).sum(axis=0)]  # fmt: skip
        gain = abs(phases[0] * phases[1]) ** 4
        land = 0.03 * place[2] / r * r * gain / r**4
        slow = radio.scale**2 * land.sum() * NETWORK.cell_m / 24 * 2 * np.pi / 2000
        assert found[cell] == pytest.approx(slow, rel=2e-3)


@pytest.mark.parametrize(
    ("law", "shape", "distribution"),
    [
        ("rayleigh", 1.0, stats.rayleigh(scale=np.sqrt(0.5))),
        ("weibull", 1.3, stats.weibull_min(1.3, scale=1 / np.sqrt(stats.weibull_min(1.3).moment(2)))),
        ("weibull", 2.0, stats.rayleigh(scale=np.sqrt(0.5))),
        ("k", 0.8, None),
    ],
)
def test_cells_have_the_amplitude_law_they_were_given(law, shape, distribution):
    rng = np.random.default_rng(8)
    texture = clutter.texture(law, shape, 1.0 - rng.random((2, 20_000)))
    amplitude = np.sqrt(texture) * abs(windblown.speckle(rng, 20_000, 1, 2.5e-3, 3.0, 6.0, 0.06)[:, 0])
    if law != "k":
        assert stats.kstest(amplitude, distribution.cdf).pvalue > 0.01
    else:
        # K law: P(|A| > x) = 2 / Gamma(nu) (b x)^nu K_nu(2 b x), b = sqrt(nu).
        def below(x: np.ndarray) -> np.ndarray:
            y = np.sqrt(shape) * x
            return 1 - 2 / gamma(shape) * y**shape * kv(shape, 2 * y)

        assert stats.kstest(amplitude, below).pvalue > 0.01


def test_windblown_land_has_billingsleys_spectrum_and_ratio():
    wavelength, step, wind = 0.06, 2.5e-3, 4.5
    still, beta = clutter.windblown(wind, SPEED_OF_LIGHT / wavelength)
    # At 10 statute miles an hour: a ratio of 489.8 / 10^1.55 / f^1.21 and 1 / beta = 0.1048 (1 + 0.4147) m/s.
    ten = clutter.windblown(4.4704, 4.9e9)
    assert ten[0] == pytest.approx(489.8 / 10**1.55 / 4.9**1.21)
    assert 1 / ten[1] == pytest.approx(0.1048 * 1.4147)
    waves = windblown.speckle(np.random.default_rng(9), 5000, 400, step, still, beta, wavelength)
    assert (abs(waves) ** 2).mean() == pytest.approx(1, rel=0.05)
    lags = np.arange(0, 200, 7)
    found = [(waves[:, lag:] * waves[:, : 400 - lag].conj()).mean().real for lag in lags]
    # The exponential spectrum's autocorrelation is a Lorentzian; the still part adds its share at all lags.
    moving = 1 / (1 + (4 * np.pi * lags * step / (beta * wavelength)) ** 2)
    np.testing.assert_allclose(found, (still + moving) / (1 + still), atol=0.05)
    loose = windblown.speckle(np.random.default_rng(1), 2000, 400, step, 0.0, beta, wavelength)
    taper = np.hanning(400)
    power = (abs(np.fft.fft(loose * taper, axis=1)) ** 2).mean(axis=0)
    speed = np.fft.fftfreq(400, step) * wavelength / 2
    fair = (abs(speed) > 0.1) & (abs(speed) < 0.9)
    slope = np.polyfit(abs(speed[fair]), np.log(power[fair]), 1)[0]
    assert -slope == pytest.approx(beta, rel=0.03)


def test_land_fills_the_range_cells_and_only_those_in_reach():
    view = seen(body([[0, 0, 0]]), x_m=200.0, y_m=100.0, z_m=60.0)
    settings = settings_of(law="rayleigh", wind_mps=0.0, reach_m=600.0)
    centred = np.exp(0.5j * np.pi * np.arange(NETWORK.subcarriers) / NETWORK.subcarriers)
    total = 0.0
    for seed in range(60):
        cells = np.fft.ifft(clutter.scatter(settings, view, np.random.default_rng(seed)) * centred, axis=1)
        assert abs(cells - cells[0]).max() < 1e-12 * abs(cells).max()
        total = total + abs(cells[0]) ** 2 / 60
    power = clutter.cell_power(settings, NETWORK, view.station, view.aim_m)
    assert total[len(power) :].max() < 1e-25 * total.max()
    assert total[: int(25 / NETWORK.cell_m)].max() < 1e-25 * total.max()
    ratio = total[6 : len(power)] / power[6:]
    assert ratio.mean() == pytest.approx(1, abs=5 / np.sqrt(60 * len(ratio)))
    set_ratio = settings_of(law="rayleigh", wind_mps=0.0, reach_m=600.0, clutter_to_signal_db=10.0)
    cells = np.fft.ifft(clutter.scatter(set_ratio, view, np.random.default_rng(0)), axis=1)
    plain = np.fft.ifft(clutter.scatter(settings, view, np.random.default_rng(0)), axis=1)
    gain = (abs(cells[0]).max() / abs(plain[0]).max()) ** 2
    assert gain * power.sum() == pytest.approx(10 * clutter.target_power(view))
    echo = response(NETWORK, view.station, view.places, view.cloud.rcs_m2, view.aim_m)
    # One point in the middle of both beams: its range cells together hold its power.
    assert clutter.target_power(view) == pytest.approx((abs(np.fft.ifft(echo, axis=1)[0]) ** 2).sum(), rel=1e-9)


def test_land_folds_at_the_unambiguous_range_and_vanishes_with_its_reflectivity():
    network = replace(NETWORK, subcarriers=32)
    view = seen(body([[0, 0, 0]]), network, x_m=100.0, y_m=50.0, z_m=60.0)
    found = clutter.scatter(settings_of(), view, np.random.default_rng(0))
    assert found.shape == (400, 32)
    assert np.isfinite(found).all()
    weak = clutter.scatter(settings_of(gamma=0.03e-12), view, np.random.default_rng(0))
    np.testing.assert_allclose(weak, 1e-6 * found, rtol=1e-9)
    assert clutter.idle(settings_of(gamma=0.0))
    assert not clutter.idle(clutter.DEFAULTS)
