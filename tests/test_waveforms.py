"""Other radars by the same echo: a continuous wave is one subcarrier, an FMCW sweep is the band's subcarriers."""

import numpy as np
import pytest

import pointwise_echo
from lowalt.config.network import SPEED_OF_LIGHT, Network


def moving(network: Network, speed_mps: float) -> np.ndarray:
    """Three points 60 m away that recede, (symbols, 3, 3) m."""
    start = np.array([[60.0, 0.0, 25.0], [60.7, 0.3, 25.2], [59.5, -0.4, 24.9]])
    return start + network.times_s[:, None, None] * np.array([speed_mps, 0.0, 0.0])


def delays(places: np.ndarray) -> np.ndarray:
    """Delays there and back (s) of places (..., 3)."""
    return 2 * np.linalg.norm(places - [0.0, 0.0, 25.0], axis=-1) / SPEED_OF_LIGHT


def radar(**waveform) -> Network:
    """One station of single elements at 24 GHz."""
    return Network.from_settings({
        "carrier_hz": 24e9, "waveform": waveform, "symbol_interval_s": 0.5e-3, "symbols": 400, "transmit_array": [1, 1],
        "receive_array": [1, 1], "power_w": 1.0, "stations": {"A": {"position_m": [0, 0, 25], "normal_deg": 0}},
    })  # fmt: skip


@pytest.mark.parametrize("speed_mps", [-3.0, 0.5])
def test_one_subcarrier_is_a_continuous_wave(speed_mps):
    network = radar(kind="cw")
    places = moving(network, speed_mps)
    found = pointwise_echo.subcarriers(network, network.stations[0], places, np.ones(3), places[0].mean(axis=0))[:, 0]
    tau = delays(places)
    direct = (np.exp(-2j * np.pi * 24e9 * tau) / tau**2).sum(axis=1)
    np.testing.assert_allclose(found / found[0], direct / direct[0], atol=1e-8)


@pytest.mark.parametrize("speed_mps", [-3.0, 0.5])
def test_the_subcarriers_of_a_band_are_the_samples_of_an_fmcw_sweep(speed_mps):
    """Against dechirped samples with motion during the sweep and the residual video phase: equal but for a shift of
    f_D T in range, below a tenth of a cell here, and a phase of the whole look."""
    samples, sweep_hz, sweep_s = 128, 150e6, 50e-6
    network = radar(kind="fmcw", sweep_hz=sweep_hz, sweep_s=sweep_s, samples=samples)
    places, slope = moving(network, speed_mps), sweep_hz / sweep_s
    found = pointwise_echo.range_cells(network, network.stations[0], places, np.ones(3), places[0].mean(axis=0))
    within_s = np.arange(samples) * sweep_s / samples
    later = places[:, None] + within_s[:, None, None] * np.array([speed_mps, 0.0, 0.0])
    tau = delays(later)
    phase = 24e9 * tau + slope * tau * within_s[:, None] - 0.5 * slope * tau**2
    sweeps = np.fft.ifft((np.exp(-2j * np.pi * phase) / tau**2).sum(axis=2), axis=1)
    cell = abs(found).argmax(axis=1)
    assert (abs(abs(sweeps).argmax(axis=1) - cell) <= 1).all() and (abs(sweeps).argmax(axis=1) == cell).mean() > 0.9
    ours, theirs = (matrix[np.arange(400), cell] for matrix in (found, sweeps))
    assert abs(np.vdot(ours, theirs)) > 0.995 * np.linalg.norm(ours) * np.linalg.norm(theirs)
