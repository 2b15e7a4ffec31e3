"""FMCW and continuous-wave radars: sums over every sample at its own time, and laws.

The laws are of range, noise and receiver.
"""

import numpy as np
import pytest

import reference_effects
from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.scene.chain import SceneSample
from scenes import sample_of

SWEEP = {"kind": "fmcw", "sweep_hz": 150e6, "sweep_s": 400e-6, "samples": 32}
BLOCK = {
    "carrier_hz": 24e9,
    "symbol_interval_s": 0.5e-3,
    "symbols": 3,
    "transmit_array": [2, 2],
    "receive_array": [3, 1],
    "power_w": 0.1,
    "stations": {"A": {"position_m": [0.0, 0.0, 10.0], "normal_deg": 17.0}},
}


def radio(waveform: dict | None = None, **changes) -> Network:
    """A radar of one station at 10 m height."""
    return Network.from_settings(BLOCK | {"waveform": waveform or SWEEP} | changes)


def sample(effects: dict, network: Network, **changes: float) -> SceneSample:
    """A target of five points before that radar."""
    return sample_of(effects, network, 7, 5, **changes)


def test_motion_inside_a_sweep_is_the_sum_over_every_sample_at_its_own_time():
    network = radio()
    found = sample({"symbol_motion": {}}, network, rate_hz=300.0)
    view = found.view
    station = network.stations[0]
    truth = np.zeros((3, 32), complex)
    scale = np.sqrt(0.1 / 12) * SPEED_OF_LIGHT / 24e9 / (4 * np.pi) ** 1.5
    for n, m in np.ndindex(truth.shape):
        t = m * 400e-6 / 32
        places = view.at(np.array([n * 0.5e-3 + t])).places[0]
        frequency = 24e9 + 150e6 / 400e-6 * t
        out, back = (
            reference_effects.one_way(
                network, station, shape, places, view.aim_m, frequency, False, False
            )
            for shape in ((2, 2), (3, 1))
        )
        truth[n, m] = scale * (np.sqrt(view.cloud.rcs_m2) * out * back).sum()
    assert abs(found.arrived() - truth).max() < 1e-10 * abs(truth).max()
    assert abs(found.direct - truth).max() > 0.1 * abs(truth).max()


@pytest.mark.parametrize("speed_mps", [-20.0, 20.0])
def test_a_target_that_moves_reads_its_doppler_frequency_times_the_sweep_in_range_cells(speed_mps):
    network = radio(symbols=1)
    moves = {
        "x_m": 40.0,
        "y_m": 0.0,
        "z_m": 10.0,
        "vx_mps": speed_mps,
        "vy_mps": 0.0,
        "vz_mps": 0.0,
        "rate_hz": 0.0,
    }
    still, moving = (
        sample(effects, network, **moves).arrived()[0] for effects in ({}, {"symbol_motion": {}})
    )
    # The slope of the phase over a sweep is the beat frequency: -2 pi times a cell a sample and M
    # cells.
    step = np.angle(moving[1:] * moving[:-1].conj() * (still[1:] * still[:-1].conj()).conj()).mean()
    assert -step * 32 / (2 * np.pi) == pytest.approx(
        2 * speed_mps * 24e9 / SPEED_OF_LIGHT * 400e-6, rel=0.01
    )


def test_noise_is_that_of_the_energy_of_a_sweep_or_of_a_sample_of_a_continuous_wave():
    """A matched filter's signal over noise is E / (k T F).

    The energy E is the transmit power times the time of a sweep.
    """
    density = 1.380649e-23 * 290 * 10**0.7
    for waveform, time_s in ((SWEEP, 400e-6), ({"kind": "cw"}, 0.5e-3)):
        empty = sample({"receiver_noise": {}}, radio(waveform, symbols=4000)).without_target()
        np.testing.assert_allclose((abs(empty.cells) ** 2).mean(axis=0), density / time_s, rtol=0.1)


def test_a_set_snr_holds_in_every_range_cell():
    found = sample({"cell_noise": {"snr_db": 10.0}}, radio(symbols=4000))
    np.testing.assert_allclose(
        (abs(found.without_target().cells) ** 2).mean(axis=0), found.power / 10, rtol=0.1
    )


def test_a_mixer_images_a_range_cell_in_its_mirror_and_a_converter_bounds_its_samples():
    found, clean = (sample(effects, radio()) for effects in ({"iq_imbalance": {}}, {}))
    image = np.roll(clean.cells[:, ::-1], 1, axis=1).conj()
    (effect,) = found.scene.effects
    mu, nu = effect.module.coefficients(effect.settings)
    assert abs(found.cells - mu * clean.cells - nu * image).max() < 1e-12 * abs(clean.cells).max()
    coarse = sample({"adc": {"bits": 1}}, radio()).arrived()
    assert len(np.unique(coarse.real.round(15))) == len(np.unique(coarse.imag.round(15))) == 2


def test_white_phase_noise_fills_the_bandwidth_of_the_samples():
    white = {"points": [[1.0, -80.0]], "shared": False, "loop_hz": 0.0}
    network = radio({**SWEEP, "samples": 128}, symbols=100)
    found, clean = (sample(effects, network).arrived() for effects in ({"phase_noise": white}, {}))
    assert np.angle(found / clean).var() == pytest.approx(1e-8 * 128 / 400e-6, rel=0.05)


def test_a_detector_begins_at_the_range_cell_that_the_beam_points_at():
    found = sample(
        {"detector": {"range_error_m": 0.0, "training": 8}},
        radio({**SWEEP, "samples": 64}),
        x_m=20.0,
    )
    assert abs(found.received().cell - found.true_cell(found.view)).max() <= 1
