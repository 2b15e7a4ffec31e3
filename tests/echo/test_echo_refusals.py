"""What the echo refuses, by the argument's name, its value and the sample."""

import dataclasses

import numpy as np
import pytest
from test_echo import network

from lowalt.config.network import Station
from lowalt.echo import Rigid, echo_signal
from lowalt.echo.echo_input import target
from lowalt.files.errors import InputError
from tables import rows

NET = network(symbols=2)
SEEN = NET.stations[0]
PLACES = np.random.default_rng(1).normal(50, 3, (2, 3, 3))
STILL = Rigid(np.zeros((2, 3, 3, 3)), PLACES, np.ones((3, 3)), np.arange(3))
GOOD = {"motion": PLACES, "rcs_m2": 1.0, "aim_m": (9.0, 9.0, 9.0), "tolerance": None}


def inside(places: np.ndarray, at: tuple[int, int]) -> np.ndarray:
    """The places with one point moved into the station."""
    moved = places.copy()
    moved[at] = SEEN.position_m
    return moved


REFUSED = [
    ({"motion": PLACES * [1, 1, np.nan]}, r"positions\[0, 0, 2\] is nan"),
    ({"motion": np.full((2, 3, 3), 1e308) * [1, 1, -np.inf]}, r"positions\[0, 0, 2\] is -inf"),
    (
        {"motion": inside(PLACES, (1, 2))},
        "position of point 2 at symbol 1 is .*, the place of station A .r = 0",
    ),
    ({"rcs_m2": np.array([1.0, -2.0, -3.0])}, r"rcs_m2\[2\] is -3.0, expected square metres >= 0"),
    ({"rcs_m2": np.ones(2)}, r"rcs_m2 has shape \(2,\), expected \(3,\)"),
    ({"rcs_m2": "much"}, "rcs_m2 is .*much.*, expected real numbers"),
    (
        {"motion": target(PLACES, 1.0)},
        "rcs_m2 is 1.0, expected None: a Target holds its cross sections",
    ),
    ({"aim_m": SEEN.position_m}, "aim_m is .*no direction to aim at"),
    ({"aim_m": (np.nan, 0.0, 25.0)}, r"aim_m\[0\] is nan"),
    *(
        ({"tolerance": wrong}, "tolerance is .*, expected null or a number between 0 and 1")
        for wrong in (0.0, 1.0, -1e-3, float("nan"), "1e-3", 2)
    ),
    *(({"motion": np.zeros(shape)}, said) for shape, said in rows("echoes", "places")),
    *(
        ({"motion": STILL._replace(**{field: np.full(shape, value, kind)})}, said)
        for field, shape, value, kind, said in rows("echoes", "parts")
    ),
]


@pytest.mark.parametrize(("change", "told"), REFUSED, ids=[told for _, told in REFUSED])
def test_a_wrong_argument_is_named_with_its_sample(change, told):
    with (
        np.errstate(over="ignore", invalid="ignore"),
        pytest.raises(InputError, match=f"^tern: {told}"),
    ):
        echo_signal(NET, SEEN, **GOOD | change, sample="tern")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"frequency_hz": -1.0}, "frequency_hz is -1.0, expected a positive number"),
        ({"frequency_hz": np.inf}, "frequency_hz is inf, expected a positive number"),
        ({"normal_rad": np.nan}, "position_m .* or normal_rad nan is not finite"),
        ({"position_m": (0.0, np.inf, 25.0)}, "position_m .*inf.* is not finite"),
        ({"position_m": (1.0, 2.0)}, "position_m .* is not finite"),
        ({"transmitter": Station("B", (1.0, 2.0, 3.0), 0.0, 4.9e9)}, "link between two stations"),
    ],
)
def test_a_station_that_cannot_hear_itself_is_named(change, told):
    with pytest.raises(InputError, match=f"station A.*{told}"):
        echo_signal(NET, dataclasses.replace(SEEN, **change), PLACES, 1.0, (9.0, 9.0, 9.0))


def test_numbers_whose_sum_overflows_are_finite_all_the_same_and_read_only_arrays_are_taken():
    far = np.full((2, 3, 3), 1e308)
    far.setflags(write=False)
    with np.errstate(over="ignore", invalid="ignore"):
        seen = target(far, 1.0)
    # Kernels would be compiled once more for arrays that are read-only.
    assert (seen.translation == far).all() and all(array.flags.writeable for array in seen)
