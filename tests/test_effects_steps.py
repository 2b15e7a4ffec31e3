"""Interpolation before a converter: coarser than rounding where a tolerance allows it, and exact enough behind it."""

import numpy as np
import pytest

from lowalt.effects.catalogue import called
from lowalt.effects.chain import EXACT, Chain
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.steps import SHARE, error_before, steps_alone
from test_effects_bounds import network, target

NEAR = {"squint": {}, "wavefront": {}, "symbol_motion": {}}


def given():
    radio = network(subcarriers=64, symbols=60, transmit=(8, 4), receive=(8, 4))
    cloud, row = target([[0, 0, 0], [1.5, 0.4, 0.2], [-1.0, 0.7, 0.1]], x_m=35.0, y_m=8.0, vx_mps=12.0, vy_mps=-5.0)
    return radio, cloud, row


@pytest.mark.parametrize("bits", [6, 10])
def test_behind_a_converter_the_mean_square_error_stays_within_its_share_of_the_tolerance(bits):
    radio, cloud, row = given()
    effects, station = tuple(called(NEAR | {"adc": {"bits": bits}})), radio.stations[0]
    exact, coarse = (
        received_signal(Scene(radio, 3, tolerance, effects), station, cloud, row).signal for tolerance in (None, 1e-2)
    )
    allowed = SHARE * 1e-2 * abs(exact).max()
    assert np.sqrt(np.mean(abs(coarse - exact) ** 2)) <= allowed
    assert abs(coarse - exact).max() <= 1e-2 * abs(exact).max()
    # The test would say nothing if interpolation stayed at rounding.
    chain = chain_of(radio, cloud, row, effects)
    chain.run(frozenset(), leads=False)
    assert error_before(chain, allowed) > 100 * EXACT
    # Small errors count by the root of error times step, so half of the root asks for a quarter of the error.
    assert error_before(chain, 0.01 * chain.receiving.step) == pytest.approx(
        4 * error_before(chain, 0.005 * chain.receiving.step)
    )


def test_an_error_moves_codes_by_a_mean_square_of_itself_times_the_step():
    rng = np.random.default_rng(2)
    samples, step, wrong = rng.uniform(-1, 1, 200_000), 2.0**-7, 1e-5
    moved = step * (np.floor((samples + wrong) / step) - np.floor(samples / step))
    assert np.mean(moved**2) == pytest.approx(wrong * step, rel=0.2)


@pytest.mark.parametrize(
    ("effects", "alone"),
    [
        ({"adc": {}}, True),
        ({"adc": {}, "iq_imbalance": {}, "canceller": {}, "detector": {}}, True),
        ({"iq_imbalance": {}}, False),
        ({"detector": {}}, False),
    ],
)
def test_only_converters_and_choices_of_cells_may_be_sudden(effects, alone):
    radio, cloud, row = given()
    assert steps_alone(chain_of(radio, cloud, row, tuple(called(NEAR | effects)))) is alone


def chain_of(radio, cloud, row, effects):
    scene, station = Scene(radio, 3, 1e-2, effects), radio.stations[0]
    view = observe(scene, station, cloud, row)
    return Chain(list(effects), view, lambda name: scene.stream(name, row, station.name), 1.0)
