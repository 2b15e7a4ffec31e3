"""Land's range side lobes and its texture from cell to cell, against land of many more patches and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from lowalt.effects.channel import clutter, patches
from test_effects_channel import NETWORK, body, seen
from test_effects_clutter import settings_of


def finely(power: np.ndarray, count: int, parts: int = 16) -> np.ndarray:
    """Mean power in `count` range cells of rings, a quarter of a cell off the centres, that hold many patches each."""
    m, total = np.arange(count), np.zeros(count)
    for part in range(parts):
        at = np.arange(len(power)) - 0.25 + (part + 0.5) / parts
        lobes = abs(np.exp(-2j * np.pi * np.outer(at, m) / count) @ np.exp(2j * np.pi * np.outer(m, m) / count)) ** 2
        total += power @ lobes / (parts * count**2)
    return total


def test_one_patch_a_cell_has_the_mean_side_lobes_of_land_that_fills_it():
    power = np.zeros(64)
    power[5:9] = [4.0, 0.5, 1.0, 2.0]
    ours, truth = patches.with_side_lobes(power, 64), finely(power, 64)
    assert ours.sum() == pytest.approx(power.sum(), rel=1e-12)
    # Away from the land within 0.3 dB, on it within 2 dB.
    far = np.r_[0:2, 13:64]
    assert abs(10 * np.log10(ours[far] / truth[far])).max() < 0.3
    assert abs(10 * np.log10(ours[5:9] / truth[5:9])).max() < 2.0


def test_side_lobes_of_near_land_cover_far_cells():
    station, aim = NETWORK.station("A"), np.array([120.0, 60.0, 150.0])
    power = clutter.cell_power(settings_of(reach_m=1000.0), NETWORK, station, aim)
    full = patches.with_side_lobes(power, NETWORK.subcarriers)
    cell = round(400.0 / NETWORK.cell_m)
    assert full[cell] == pytest.approx(finely(power, NETWORK.subcarriers)[cell], rel=0.15)
    # Beams that point up see the land at the mast's foot by their side lobes; it covers cells 28 dB and more below.
    assert 10 * np.log10(full[cell] / power[cell]) > 5
    assert 10 * np.log10(full[6:200] / power[6:200]).max() > 28


def test_drawn_land_has_its_mean_power_in_every_cell():
    network = replace(NETWORK, subcarriers=64, symbols=2)
    view = seen(body([[0, 0, 0]]), network, np.zeros(1), x_m=150.0, y_m=60.0, z_m=60.0)
    settings = settings_of(law="rayleigh", wind_mps=0.0)
    drawn = [clutter.scatter(settings, view, np.random.default_rng(seed)) for seed in range(400)]
    power = np.mean(abs(np.fft.ifft(drawn, axis=2)[:, 0]) ** 2, axis=0)
    mean = patches.with_side_lobes(clutter.mean_power(settings, view), 64)
    assert abs(power / mean - 1).max() < 5 / np.sqrt(400)


@pytest.mark.parametrize("correlation_m", [5.0, 40.0])
def test_textures_keep_their_law_and_are_alike_over_the_set_distance(correlation_m):
    correlation = np.exp(-NETWORK.cell_m / correlation_m)
    uniform = patches.alike(1.0 - np.random.default_rng(2).random((2, 200_000)), correlation)
    score = stats.norm.ppf(uniform)
    for lag in (1, 3):
        found = np.mean(score[:, lag:] * score[:, :-lag], axis=1)
        assert found == pytest.approx(correlation**lag, abs=0.03)
    every = int(12 / (1 - correlation))
    for law, shape in (("k", 0.8), ("weibull", 1.3)):
        texture = clutter.texture(law, shape, uniform)
        apart = clutter.texture(law, shape, 1.0 - np.random.default_rng(3).random((2, 20_000)))
        assert stats.ks_2samp(texture[::every], apart).pvalue > 0.01


def test_independent_cells_keep_every_bit():
    uniform = 1.0 - np.random.default_rng(2).random((2, 30))
    assert patches.alike(uniform, 0.0) is uniform
