"""The ground's material at the carrier's frequency."""

from dataclasses import replace

import pytest

from effects_frames import network
from lowalt.common.errors import InputError
from lowalt.effects.channel import ground_reflection
from lowalt.effects.checks import CheckedScene

# ITU-R P.2040's power laws worked by hand: (material, GHz) -> permittivity and conductivity (S/m).
BY_HAND = {
    ("medium_dry_ground", 1.0): (15.0, 0.035),
    ("medium_dry_ground", 4.9): (12.8, 0.467),
    ("wet_ground", 4.9): (15.9, 1.18),
    ("wet_ground", 10.0): (11.94, 2.99),
    ("very_dry_ground", 3.5): (3.0, 0.00352),
    ("concrete", 28.0): (5.24, 0.626),
}


@pytest.mark.parametrize(("key", "expected"), BY_HAND.items(), ids=str)
def test_a_material_has_its_properties_at_the_frequency(key, expected):
    settings = {**ground_reflection.DEFAULTS, "material": key[0]}
    assert ground_reflection.ground(settings, key[1] * 1e9) == pytest.approx(expected, rel=4e-3)


def test_given_properties_replace_the_materials_one_by_one():
    settings = {**ground_reflection.DEFAULTS, "permittivity": 7.0}
    assert ground_reflection.ground(settings, 1e9) == (7.0, 0.035)
    assert ground_reflection.ground({**settings, "conductivity_s_m": 0.0}, 1e9) == (7.0, 0.0)


def checked(carrier_hz: float, **given) -> None:
    radio = network(4, 8)
    stations = tuple(replace(station, frequency_hz=carrier_hz) for station in radio.stations)
    moved = replace(radio, carrier_hz=carrier_hz, stations=stations)
    ground_reflection.check({**ground_reflection.DEFAULTS, **given}, CheckedScene(moved, {}, ()))


def test_a_material_beyond_its_frequencies_is_refused():
    checked(4.9e9)
    checked(28e9, material="concrete")
    checked(28e9, permittivity=5.0, conductivity_s_m=0.1)
    with pytest.raises(InputError, match="known from 1 to 10 GHz, station A sends at 28 GHz"):
        checked(28e9)
    with pytest.raises(InputError, match="expected permittivity and conductivity_s_m"):
        checked(0.7e9, permittivity=5.0)
