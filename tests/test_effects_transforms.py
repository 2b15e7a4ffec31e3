"""Transforms of symbols against sums over all subcarriers, written out."""

import numpy as np
import pytest

from lowalt.effects import transforms


def numbers(*shape):
    """Complex normal numbers."""
    return np.random.default_rng(5).standard_normal((*shape, 2)).view(np.complex128)[..., 0]


@pytest.mark.parametrize("count", [256, 12])
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_transform_is_the_sum_over_all_numbers_of_a_row(count, sign):
    given = numbers(3, count)
    # Whole turns are left out in whole numbers, so the sum is exact to rounding.
    number = np.arange(count)
    truth = given @ np.exp(sign * 2j * np.pi * (np.outer(number, number) % count) / count)
    transform, truth = (transforms.forward, truth) if sign < 0 else (transforms.inverse, truth / count)
    kept = given.copy()
    found = transform(given)
    np.testing.assert_array_equal(given, kept)
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-14 * abs(truth).max() * np.log2(count))
    assert transform(given, out=given) is given
    np.testing.assert_array_equal(given, found)


def test_a_transform_of_every_single_number_is_its_wave():
    count = transforms.LENGTH
    number = np.arange(count)
    found = transforms.forward(np.eye(count, dtype=complex))
    np.testing.assert_allclose(found, np.exp(-2j * np.pi * (np.outer(number, number) % count) / count), atol=4e-16)


def test_a_row_does_not_depend_on_the_rows_beside_it():
    given = numbers(5, 256)
    np.testing.assert_array_equal(transforms.inverse(given)[3:4], transforms.inverse(given[3:4]))
    np.testing.assert_array_equal(transforms.inverse(given[::2]), transforms.inverse(given)[::2])


@pytest.mark.parametrize("count", [256, 13])
def test_samples_of_turned_tones_are_sums_over_subcarriers_about_the_oscillator(count):
    given, turns = numbers(3, count), numbers(7, count)[6]
    kept, number = given.copy(), np.arange(count)
    wave = np.exp(2j * np.pi * (np.outer(number - count // 2, number) % count) / count)
    truth = (given * turns) @ wave / count
    np.testing.assert_allclose(transforms.turned(given, turns), truth, rtol=0, atol=1e-14 * abs(truth).max())
    np.testing.assert_array_equal(given, kept)
    one = np.broadcast_to(given[:1], given.shape)
    np.testing.assert_array_equal(transforms.turned(one, turns), transforms.turned(given[[0, 0, 0]], turns))
