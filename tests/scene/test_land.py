"""Land: its power, its amplitude laws, its Doppler and its side lobes.

Its power is tested by closed forms and sums over a fine grid.
"""

import numpy as np
import pytest
from scipy import stats
from scipy.special import gamma, kv

from lowalt.echo.radar import radar
from lowalt.scene import land
from lowalt.scene.antenna import Element, gain
from lowalt.scene.effects.channel import clutter
from lowalt.scene.laws import windblown
from scenes import A, link, linked, network, view_of

AIMS = np.array([[60.0, 30.0, 25.0], [62.0, 28.0, 24.0]])


def settings_of(**changes) -> dict:
    return clutter.DEFAULTS | changes


def test_land_has_the_closed_power_of_its_rings():
    radio = network(transmit=(1, 1), receive=(1, 1), subcarriers=256)
    height = 10.0
    power, slow = land.cell_power(settings_of(), radio, A, AIMS)
    edges = np.clip((np.arange(len(power))[:, None] + [-0.25, 0.75]) * radio.cell_m, height, 1000.0)
    # sigma0 r dr dphi / r^4 with sigma0 = gamma h / r, all around.
    rings = 2 * np.pi * 0.03 * height / 3 * (edges[:, 0] ** -3 - edges[:, 1] ** -3)
    np.testing.assert_allclose(power, radar(radio, A).scale ** 2 * rings, rtol=1e-6, atol=1e-30)
    assert (slow == 1).all()


@pytest.mark.parametrize("element", [None, Element(downtilt_deg=6.0)])
@pytest.mark.parametrize("station", [A, link()])
def test_cells_hold_the_land_of_a_fine_grid_under_both_beams(station, element):
    radio = linked(subcarriers=256)
    power, slow = land.cell_power(settings_of(reach_m=110.0), radio, station, AIMS, element)
    step = 0.4
    x, y = np.meshgrid(np.arange(-120, 240, step), np.arange(-130, 150, step))
    places = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    each = np.full(len(places), 0.03 * step**2 * radar(radio, station).scale ** 2)
    sums = 0.0
    toward = []
    for end, shape, aim in zip(
        (station.transmitter or station, station), ((4, 2), (4, 2)), AIMS, strict=True
    ):
        away = places - end.position_m
        ahead = (aim - end.position_m) / np.linalg.norm(aim - end.position_m)
        r = np.linalg.norm(away, axis=1)
        unit = away / r[:, None]
        frequency = radar(radio, station).kappa
        across = (unit - ahead) @ end.horizontal
        up = (unit - ahead)[:, 2]
        sum_of = [
            abs(np.exp(1j * np.pi * frequency * np.outer(np.arange(n), c)).sum(axis=0))
            for n, c in zip(shape, (across, up), strict=True)
        ]
        each *= (sum_of[0] * sum_of[1]) ** 2 * np.sqrt(end.position_m[2] / r) / r**2
        each *= 1.0 if element is None else gain(element, end, places)
        sums = sums + r / 2
        toward = [*toward, unit]
    cell = np.floor(sums / radio.cell_m + 0.25).astype(int)
    held = (cell < len(power)) & (sums <= 110.0)
    expected = np.bincount(cell[held], each[held], len(power))
    strong = expected > 0.01 * expected.max()
    assert strong.sum() > 4
    np.testing.assert_allclose(power[strong], expected[strong], rtol=0.02)
    half = np.sqrt(0.5 + 0.5 * np.clip((toward[0] * toward[1]).sum(axis=1), -1, 1))
    slowed = np.bincount(cell[held], (each * half)[held], len(power))[strong] / expected[strong]
    np.testing.assert_allclose(slow[strong], slowed, rtol=0.01)


@pytest.mark.parametrize(
    "law, shape", [("rayleigh", 1.0), ("weibull", 1.3), ("weibull", 2.0), ("k", 0.8)]
)
def test_cells_have_the_amplitude_law_they_were_given(law, shape):
    rng = np.random.default_rng(8)
    texture = clutter.texture(law, shape, 1.0 - rng.random((2, 20_000)))
    amplitude = np.sqrt(texture) * abs(
        windblown.speckle(rng, 20_000, 1, 2.5e-3, (3.0, 6.0), 0.06)[:, 0]
    )

    def k_law(x: np.ndarray) -> np.ndarray:
        """1 - 2 / Gamma(nu) (b x)^nu K_nu(2 b x), b = sqrt(nu)."""
        y = np.sqrt(shape) * x
        return 1 - 2 / gamma(shape) * y**shape * kv(shape, 2 * y)

    weibull = stats.weibull_min(shape, scale=1 / np.sqrt(stats.weibull_min(shape).moment(2)))
    below = {
        "rayleigh": stats.rayleigh(scale=np.sqrt(0.5)).cdf,
        "weibull": weibull.cdf,
        "k": k_law,
    }[law]
    assert stats.kstest(amplitude, below).pvalue > 0.01


def test_neighbours_textures_are_alike_and_keep_their_law():
    uniform = clutter.alike(1.0 - np.random.default_rng(2).random((2, 50_000)), 0.8)
    assert stats.kstest(uniform[0, ::40], "uniform").pvalue > 0.01
    score = stats.norm.ppf(uniform[0])
    found = [np.corrcoef(score[lag:], score[: len(score) - lag])[0, 1] for lag in (1, 2, 4)]
    np.testing.assert_allclose(found, [0.8, 0.64, 0.4096], atol=0.03)


@pytest.mark.parametrize("slow", [1.0, np.full(3000, 0.5)])
def test_windblown_land_has_billingsleys_spectrum_and_ratio(slow):
    wavelength = 0.06
    step = 2.5e-3
    # At 10 statute miles an hour: a ratio of 489.8 / 10^1.55 / f^1.21 and 1 / beta = 0.1048 (1 +
    # 0.4147) m/s.
    still, beta = windblown.windblown(4.4704, 4.9e9)
    assert still == pytest.approx(489.8 / 10**1.55 / 4.9**1.21)
    assert 1 / beta == pytest.approx(0.1048 * 1.4147)
    waves = windblown.speckle(
        np.random.default_rng(9), 3000, 400, step, (still, beta), wavelength, slow
    )
    lags = np.arange(0, 200, 7)
    found = [(waves[:, lag:] * waves[:, : 400 - lag].conj()).mean().real for lag in lags]
    # The exponential spectrum's autocorrelation is a Lorentzian; the still part adds its share at
    # all lags.
    moving = 1 / (1 + (4 * np.pi * lags * step * np.max(slow) / (beta * wavelength)) ** 2)
    np.testing.assert_allclose(found, (still + moving) / (1 + still), atol=0.06)
    calm = windblown.speckle(
        np.random.default_rng(9), 3, 400, step, windblown.windblown(0.0, 4.9e9), wavelength
    )
    assert (calm == calm[:, :1]).all()


def test_neighbouring_cells_of_land_are_alike_over_the_correlation_length():
    """Cells are 78 m long, so a length of 1 km makes neighbours alike.

    Side lobes always do a little.
    """
    radio = network(subcarriers=16, symbols=2)
    aim = AIMS[0]
    view = view_of(radio, np.broadcast_to(aim, (2, 1, 3)), np.ones(1), aim)
    alike = []
    for length_m in (0.0, 1000.0):
        settings = settings_of(law="k", shape=0.5, reach_m=500.0, correlation_m=length_m)
        drawn = [
            clutter.scatter(settings, view, np.random.default_rng(seed)).response[0]
            for seed in range(400)
        ]
        level = np.log(abs(np.fft.ifft(drawn, axis=1)[:, :5]))
        alike.append(np.mean([np.corrcoef(level[:, i : i + 2].T)[0, 1] for i in range(4)]))
    assert alike[0] < 0.65 and alike[1] > alike[0] + 0.15


def test_drawn_land_has_its_mean_power_in_every_cell_side_lobes_and_folds_included():
    radio = network(subcarriers=16, symbols=2)
    aim = AIMS[0]
    view = view_of(radio, np.broadcast_to(aim, (2, 1, 3)), np.ones(1), aim)
    for settings in (
        settings_of(law="rayleigh", reach_m=150.0),
        settings_of(law="rayleigh", reach_m=500.0),
    ):
        power, _ = clutter.mean_power(settings, view)
        drawn = [
            clutter.scatter(settings, view, np.random.default_rng(seed)).response[0]
            for seed in range(1000)
        ]
        found = (abs(np.fft.ifft(drawn, axis=1)) ** 2).mean(axis=0)
        np.testing.assert_allclose(found, land.with_side_lobes(power, 16), rtol=0.15)
        assert found.sum() == pytest.approx(power.sum(), rel=0.08)
