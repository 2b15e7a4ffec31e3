"""A recording's frame that begins inside a symbol, against a sum over every time sample."""

import numpy as np
import pytest

from lowalt.common.network import Network
from lowalt.effects.channel import symbol_motion
from lowalt.effects.received import observe, received_signal
from lowalt.targets.cloud import Cloud
from test_effects_bounds import network, scene, summed, target

NODES = np.array([[0.0, 0, 0], [0.2, 0, 0.3], [-0.1, 0.2, 0.8]])


def recorded(frames_hz: float, symbols: int = 4, subcarriers: int = 64) -> tuple[Network, Cloud, dict]:
    """A recording of four frames that jump to and fro, and a radar with long symbols."""
    radio = network(subcarrier_spacing_hz=15e3, subcarriers=subcarriers, symbols=symbols, symbol_interval_s=1e-4)
    _, row = target(NODES, x_m=60.0)
    rng = np.random.default_rng(5)
    empty = np.full((3, 3), np.nan)
    cloud = Cloud(
        points=NODES, part=np.arange(3), kinds=("node",) * 3, names=("a", "b", "c"), parents=np.full(3, -1),
        hinges=empty, axes=empty, normals=empty, rcs_m2=np.ones(3), track=NODES + 0.01 * rng.normal(size=(4, 3, 3)),
        record={"subtype": "Thing", "category": "Pedestrian", "source": "", "checksum": "", "track_rate_hz": frames_hz},
    )  # fmt: skip
    return radio, cloud, row | {"playback": 1.0, "start_s": 0.3e-4, "category": "Pedestrian"}


@pytest.mark.parametrize("tolerance", [None, 1e-3])
@pytest.mark.parametrize(("frames_hz", "subcarriers"), [(9e3, 64), (40e3, 64), (700.0, 64), (9e3, 256)])
def test_a_frame_may_begin_inside_a_symbol(frames_hz, subcarriers, tolerance):
    radio, cloud, row = recorded(frames_hz, subcarriers=subcarriers)
    station, asked = radio.stations[0], scene(radio, {"symbol_motion": {}}, tolerance)
    received = received_signal(asked, station, cloud, row)
    truth = summed(asked, cloud, row)
    assert abs(received.signal - truth).max() <= (tolerance or 1e-10) * abs(truth).max()


def test_only_symbols_in_which_a_frame_begins_are_bent():
    radio, cloud, row = recorded(9e3, symbols=40)
    view = observe(scene(radio, {}), radio.stations[0], cloud, row)
    fine = row["start_s"] + view.times_s[:, None] + np.linspace(0, 1 / 15e3, 2001)
    frames = np.floor(fine * 9e3)
    assert (symbol_motion.bent(view) == (frames[:, -1] != frames[:, 0])).all()
    assert 0 < symbol_motion.bent(view).sum() < 40
    still, plain = target(NODES, x_m=60.0)
    assert not symbol_motion.bent(observe(scene(radio, {}), radio.stations[0], still, plain)).any()


def test_a_symbol_that_is_bent_once_needs_few_instants_before_and_after_its_bend():
    radio, cloud, row = recorded(9e3)
    view = observe(scene(radio, {}), radio.stations[0], cloud, row)
    part = view.at(view.times_s[symbol_motion.bent(view)])
    delays, weights = symbol_motion.pieces(part, 1e-13)
    assert 4 < len(delays) < 50
    # A ramp that changes its slope at the bend is followed at every sample.
    frame = (row["start_s"] + part.times_s) * 9e3
    bend = (np.ceil(frame) - frame) / 9e3
    samples = np.arange(64) / 64 / 15e3
    assert np.einsum("qnm,qn->nm", weights, abs(delays - bend)) == pytest.approx(
        abs(samples - bend[:, None]), abs=1e-15
    )
