"""Unit phasors and the turns made of them, against cosine and sine of many digits."""

import mpmath
import numpy as np
import pytest

from lowalt.effects import phasors
from lowalt.effects.receiver import _toeplitz, _turns


@pytest.mark.parametrize(("phasor", "largest"), [(phasors.phasor, 40.0), (phasors.small_phasor, phasors.SMALL)])
def test_phasors_are_cosine_and_sine_to_rounding(phasor, largest):
    for angle in [largest, -largest, *np.random.default_rng(1).uniform(-largest, largest, 200), 1e-9, 0.0]:
        cosine, sine = phasor.py_func(angle)
        with mpmath.workdps(40):
            rounding = max(largest, 1) * 3e-16
            assert abs(cosine - mpmath.cos(float(angle))) <= rounding
            assert abs(sine - mpmath.sin(float(angle))) <= rounding * min(1.0, abs(angle))


@pytest.mark.parametrize("largest", [0.9 * phasors.SMALL, 1.1 * phasors.SMALL, 30.0])
def test_tones_are_turned_by_small_and_by_large_angles(largest):
    rng = np.random.default_rng(2)
    angle = 0.1 * phasors.SMALL * rng.uniform(-1.0, 1.0, (6, 256))
    angle[[0, 2, 4], [3, 250, 128]] = largest, -largest, largest
    samples = rng.standard_normal((6, 256)) + 1j * rng.standard_normal((6, 256))
    found = _turns.phased_tones(np.fft.fft(samples), *_toeplitz.parts(angle))
    np.testing.assert_allclose(found, np.fft.fft(samples * np.exp(1j * angle)), rtol=0, atol=3e-13)
