"""Portable arithmetic against exact values, and draws against NumPy's and distributions."""

import pickle

import mpmath
import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.numerics import portable, streams
from lowalt.numerics.draws import Draws
from lowalt.numerics.matrices import nearest_rotations, thinnest

RNG = np.random.default_rng(5)
WIDE = RNG.uniform(-1e5, 1e5, 300)
NEAR = np.concatenate([RNG.uniform(-10, 10, 300), np.arange(-20, 21) * np.pi / 2])
POSITIVE = np.concatenate([np.exp(RNG.uniform(-50, 50, 300)), 1 + RNG.uniform(-0.3, 0.3, 300)])


@pytest.mark.parametrize(
    ("name", "points"),
    [
        ("sin", NEAR),
        ("sin", WIDE),
        ("cos", NEAR),
        ("cos", WIDE),
        ("exp", RNG.uniform(-50, 50, 300)),
        ("log", POSITIVE),
        ("arctan", RNG.uniform(-5, 5, 300)),
        ("arctan", 1 / RNG.uniform(-1e-3, 1e-3, 50)),
    ],
)
def test_a_function_is_within_one_unit_in_the_last_place(name, points):
    exact = getattr(mpmath, name if name != "arctan" else "atan")
    with mpmath.workprec(200):
        for x, found in zip(points, getattr(portable, name)(points), strict=True):
            true = exact(mpmath.mpf(float(x)))
            assert abs(mpmath.mpf(float(found)) - true) <= np.spacing(abs(float(true))), (x, found)


def test_quarter_turns_are_exact_and_other_turns_follow_the_sine():
    sine, cosine = portable.sine_cosine_turns(np.arange(-4, 5) / 4)
    assert sine.tolist() == [0, 1, 0, -1, 0, 1, 0, -1, 0]
    assert cosine.tolist() == [1, 0, -1, 0, 1, 0, -1, 0, 1]
    turns = RNG.uniform(-3, 3, 200)
    assert np.allclose(
        portable.sine_cosine_turns(turns),
        portable.sine_cosine(2 * np.pi * turns),
        atol=4e-15,
        rtol=0,
    )
    with pytest.raises(ValueError, match="at most"):
        portable.sin(1e7)


def test_the_angle_of_a_point_is_that_of_the_library_in_all_quadrants():
    y, x = RNG.normal(size=(2, 500))
    assert np.allclose(portable.arctan2(y, x), np.arctan2(y, x), rtol=1e-15, atol=0)
    axes = np.array([(0, 1), (1, 0), (0, -1), (-1, 0), (0, 0)], float)
    assert portable.arctan2(*axes.T).tolist() == [0, np.pi / 2, np.pi, -np.pi / 2, 0]


def test_powers_multiply_where_the_exponent_is_whole():
    base = RNG.random(100)
    assert (portable.power(base, 3) == base * base * base).all()
    assert np.allclose(portable.power(base, 0.4), base**0.4, rtol=1e-15)
    assert portable.power(np.zeros(2), 0.4).tolist() == [0, 0]


def test_products_and_sums_are_added_in_their_written_order():
    a, b = RNG.normal(size=(2, 5, 3, 3))
    expected = np.empty((5, 3, 3))
    for place in np.ndindex(5, 3, 3):
        n, i, j = place
        expected[place] = (
            a[n, i, 0] * b[n, 0, j] + a[n, i, 1] * b[n, 1, j] + a[n, i, 2] * b[n, 2, j]
        )
    assert (portable.product(a, b) == expected).all()
    assert (portable.applied(a, b[:, :, 0]) == expected[:, :, 0]).all()
    values = RNG.normal(size=1000)
    running = 0.0
    for value in values:
        running += value
    assert portable.total(values) == running
    assert portable.mean(values.reshape(10, 100), axis=0)[3] == portable.total(values[3::100]) / 10


def pair(seed: int) -> tuple[Draws, np.random.Generator]:
    return Draws(np.random.PCG64(seed)), np.random.Generator(np.random.PCG64(seed))


@pytest.mark.parametrize("seed", range(5))
def test_draws_are_those_of_the_numpy_of_today_where_it_promises_none(seed):
    mine, numpys = pair(seed)
    asked = (
        ("random",),
        ("random", (2, 3)),
        ("uniform", -3, 7),
        ("uniform", [1, 2], [3, 4]),
        ("integers", 10),
        ("integers", 5, 900_001, 7),
        ("integers", 0, 3_000_000_000, 50),
        ("permutation", 11),
        ("permutation", np.arange(7) * 2),
    )
    for name, *given in 5 * asked:
        np.testing.assert_array_equal(getattr(mine, name)(*given), getattr(numpys, name)(*given))


@pytest.mark.parametrize("last", [bytes(4), bytes(8), b"\x00\x00\x00\x01", b"\xff" * 4])
def test_a_stream_is_seeded_by_its_digest_as_one_integer(last, monkeypatch):
    """Also where the integer's upper words are zeros, which count as no words."""
    made = bytes(range(1, 33 - len(last))) + last
    monkeypatch.setattr(streams, "digest", lambda *keys: made)
    wanted = np.random.PCG64(np.random.SeedSequence(int.from_bytes(made, "little")))
    assert streams.stream(7, "any").bit_generator.state == wanted.state


def test_the_first_draws_of_a_stream_are_written_down():
    draws = Draws(np.random.PCG64(1))
    words = [int(word) for word in draws.words(2)]
    assert words == [9441442522235856127, 17532960557476522086]
    first, second = Draws(np.random.PCG64(1)).standard_normal(2)
    with mpmath.workprec(100):
        radius = mpmath.sqrt(-2 * mpmath.log(mpmath.mpf((words[0] >> 11) + 1) / 2**53))
        angle = 2 * mpmath.pi * mpmath.mpf(words[1] >> 11) / 2**53
        assert first == pytest.approx(float(radius * mpmath.cos(angle)), rel=1e-15)
        assert second == pytest.approx(float(radius * mpmath.sin(angle)), rel=1e-15)


def test_normals_and_exponentials_have_their_moments():
    draws = Draws(np.random.PCG64(7))
    normals = draws.standard_normal(100_001)
    waits = draws.exponential(2.0, 100_000)
    # Five standard errors of mean, variance and fourth moment.
    assert abs(normals.mean()) < 5 / 316
    assert abs(normals.var() - 1) < 5 * np.sqrt(2) / 316
    assert abs((normals**4).mean() - 3) < 5 * np.sqrt(96) / 316
    assert abs(waits.mean() - 2) < 5 * 2 / 316
    assert abs(np.corrcoef(normals[:-1:2], normals[1::2])[0, 1]) < 5 / 223


def test_a_choice_without_replacement_has_no_entry_twice_and_no_favourites():
    draws = Draws(np.random.PCG64(3))
    counts = np.bincount(
        np.concatenate([draws.choice(10, 4, replace=False) for _ in range(2000)]), minlength=10
    )
    assert all(len(set(draws.choice(10, 4, replace=False))) == 4 for _ in range(100))
    assert abs(counts - 800).max() < 5 * np.sqrt(800 * 0.6)
    with pytest.raises(InputError, match="without replacement"):
        draws.choice(3, 4, replace=False)
    with pytest.raises(InputError, match="integers"):
        draws.integers(0)


def test_draws_go_on_after_pickling():
    draws = Draws(np.random.PCG64(4))
    draws.integers(10)
    copy = pickle.loads(pickle.dumps(draws))
    assert (copy.integers(10, size=5) == draws.integers(10, size=5)).all()
    assert copy.standard_normal() == draws.standard_normal()


def test_the_thinnest_direction_is_the_library_s_eigenvector():
    for scales in ((3.0, 1.0, 0.2), (1.0, 1.0, 0.01), (0.5, 2.0, 2.0)):
        points = RNG.normal(size=(300, 3)) * scales @ np.linalg.qr(RNG.normal(size=(3, 3)))[0]
        points -= points.mean(axis=0)
        expected = np.linalg.eigh(points.T @ points)[1][:, 0]
        assert abs(abs(thinnest(points) @ expected) - 1) < 1e-14


def test_the_nearest_rotation_is_the_library_s_polar_factor():
    blends = np.eye(3) + 0.3 * RNG.normal(size=(50, 3, 3))
    blends = blends[np.linalg.det(blends) > 0.1]
    left, _, right = np.linalg.svd(blends)
    assert np.allclose(nearest_rotations(blends), left @ right, atol=1e-14)
