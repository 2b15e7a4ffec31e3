"""One oscillator: contradictions are refused, carrier and clock err alike, and a locked oscillator does not wander."""

import numpy as np
import pytest

from effects_frames import frame, network
from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.effects.catalogue import stream_name
from lowalt.effects.checks import CheckedScene
from lowalt.effects.receiver import carrier_offset, clock_offset, phase_noise


def checked(**effects):
    return CheckedScene(network(), effects, (np.inf,))


@pytest.mark.parametrize("module", [carrier_offset, clock_offset])
def test_an_oscillator_has_no_offset_against_itself(module):
    with pytest.raises(InputError, match="shared: true"):
        module.check(module.DEFAULTS, checked(phase_noise=phase_noise.DEFAULTS))
    module.check(module.DEFAULTS, checked(phase_noise={**phase_noise.DEFAULTS, "shared": False}))
    module.check(module.DEFAULTS, checked())


@pytest.mark.parametrize("key", ["fixed_ppm", "sigma_ppm"])
def test_carrier_and_clock_must_have_one_ppm_value(key):
    other = {**clock_offset.DEFAULTS, key: 0.02}
    with pytest.raises(InputError, match=f"{key} is 0.02 and effects.carrier_offset"):
        clock_offset.check(other, checked(carrier_offset=carrier_offset.DEFAULTS))
    clock_offset.check(other, checked(carrier_offset={**carrier_offset.DEFAULTS, key: 0.02}))


@pytest.mark.parametrize("model", range(5))
def test_carrier_and_clock_err_by_the_same_share(model):
    look = frame(network())
    draws = [
        stream(1, "effect", stream_name(name), "Thing", model, "A") for name in ("carrier_offset", "clock_offset")
    ]  # fmt: skip
    hz = carrier_offset.offset_hz({**carrier_offset.DEFAULTS, "sigma_hz": 0.0}, look, draws[0])
    rate = clock_offset.fast(clock_offset.DEFAULTS, look, draws[1])
    assert hz / look.oscillator_hz == pytest.approx(rate, rel=1e-9) and rate != 0


def slow_rms(settings):
    """Root mean square (rad) of the phase's change over a look of one second, its slow lines summed exactly."""
    look = frame(network(400, 16))
    given = {**phase_noise.DEFAULTS, "shared": False, **settings}
    drawn = [phase_noise.phase(given, look, np.random.default_rng(seed)) for seed in range(8)]
    return np.sqrt(np.mean([np.var(phase[:, 0]) for phase in drawn]))


def test_a_locked_oscillator_does_not_wander():
    assert slow_rms({"loop_hz": 0.0}) > 3.0
    assert slow_rms({}) < 0.2


def test_the_loop_leaves_the_spectrum_far_from_it_and_follows_the_reference_near():
    locked = np.array(phase_noise.disciplined(phase_noise.DEFAULTS)).T
    points = np.array(phase_noise.DEFAULTS["points"]).T
    far = points[0] >= 3e3
    assert np.interp(points[0][far], *locked) == pytest.approx(points[1][far], abs=0.01)
    assert np.interp(1.0, *locked) == pytest.approx(-46.0, abs=0.1)
    free = phase_noise.disciplined({**phase_noise.DEFAULTS, "loop_hz": 0.0})
    assert pytest.approx(points) == np.array(free).T


def test_a_reference_must_have_rising_offsets():
    with pytest.raises(InputError, match="reference"):
        phase_noise.check({**phase_noise.DEFAULTS, "reference": [[10.0, 0.0], [1.0, 0.0]]}, checked())
