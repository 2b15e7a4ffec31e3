"""An effect is left out only where all its strengths are those of the identity."""

import importlib

import pytest

from lowalt.effects.catalogue import dotted

STRENGTHS = {
    "iq_imbalance": {"gain_db": (0, 0.1), "phase_deg": (0, 0.1)},
    "link_offset": {"sigma_ppm": (0, 0.1), "sigma_s": (0, 1e-9)},
    "carrier_offset": {"fixed_hz": (0, 1), "sigma_hz": (0, 1), "fixed_ppm": (0, 0.1), "sigma_ppm": (0, 0.1)},
    "clock_offset": {"fixed_ppm": (0, 0.1), "sigma_ppm": (0, 0.1)},
    "timing_offset": {"fixed_s": (0, 1e-9), "sigma_s": (0, 1e-9)},
    "interference": {"loss_db": (None, 60), "isolation_db": (None, 60), "by_target": (False, True)},
    "walls": {"permittivity": (1, 5), "conductivity_s_m": (0, 0.1)},
    "element_pattern": {"gain_dbi": (0, 8), "back_db": (0, 30)},
    "pointing_error": {"sigma_deg": (0, 0.1), "fixed_deg": ([0, 0], [0, 0.1]), "update_s": (None, 0.1)},
    "ground_reflection": {"permittivity": (1, 5), "conductivity_s_m": (0, 0.1)},
    "fluctuation": {"pattern": (False, True), "spread_db": (0, 1)},
    "slow_time": {"downlink": (1, 0.7), "missing": (0, 0.1), "jitter_s": (0, 1e-6)},
    "rotor_spread": {"spread": (0, 0.1), "wander": (0, 0.1)},
}
"""By effect: of each strength the value that changes nothing, and one that changes something."""


@pytest.mark.parametrize("name", STRENGTHS)
def test_each_strength_alone_brings_an_effect_in(name):
    module, strengths = importlib.import_module(dotted(name)), STRENGTHS[name]
    still = {**module.DEFAULTS, **{key: values[0] for key, values in strengths.items()}}
    assert module.idle(still)
    for key, (_, strong) in strengths.items():
        assert not module.idle({**still, key: strong}), key
