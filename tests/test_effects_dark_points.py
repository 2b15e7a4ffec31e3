"""Points that one effect leaves without strength: later effects skip them, and the product of all stays."""

import gc
from dataclasses import replace

import numpy as np
import pytest

from lowalt.effects import target_echo
from lowalt.effects.catalogue import called
from lowalt.effects.channel import cross_sections, occlusion
from lowalt.effects.interface import WeighsPoints
from lowalt.effects.kept_by_arrays import KeptByArrays
from lowalt.effects.response import ImagePath, OneWayFactors
from lowalt.effects.sending import Sending
from lowalt.effects.target_echo import TargetEcho
from test_effects_occlusion import NETWORK, built

BOTH = {"cross_sections": {}, "occlusion": {}, "ground_reflection": {}}


def echo(view, effects):
    def draws(*_):
        return np.random.default_rng(1)

    return TargetEcho(list(called(effects)), view, draws, Sending([], NETWORK, draws))


def seen(name):
    view = built(name)[0]
    return replace(view, times_s=view.times_s[::10])


@pytest.mark.parametrize("name", ["DJI Mini 2", "Crow", "ZEEKR 001 2022"])
def test_skipped_points_change_no_bit_of_the_product(name):
    view = seen(name)
    whole = np.ones(view.places.shape[:2])
    for effect in called(BOTH):
        if isinstance(effect.module, WeighsPoints):
            whole = whole * effect.module.visible(effect.settings, view, None)
    np.testing.assert_array_equal(echo(view, BOTH).factor, whole)


@pytest.mark.parametrize("follow", [["occlusion"], ["cross_sections"], ["cross_sections", "occlusion"]])
def test_routes_have_the_product_of_their_own_factors(follow):
    view = seen("DJI Mini 2")
    found = echo(view, BOTH | {"reflected_aspect": {"follow": follow}})
    mirrored = view.seen_from(found.paths[0].station_m)
    wanted = np.ones((2, *view.places.shape[:2]))
    for effect in called(BOTH):
        if isinstance(effect.module, WeighsPoints):
            wanted[0] *= effect.module.visible(effect.settings, view, None)
            wanted[1] *= effect.module.visible(effect.settings, mirrored if effect.name in follow else view, None)
    np.testing.assert_allclose(found.routes, wanted, rtol=1e-15)


def test_no_ray_is_cast_for_dark_points(monkeypatch):
    view, asked = seen("DJI Mini 2"), []
    cast = occlusion.cast_rays
    monkeypatch.setattr(occlusion, "cast_rays", lambda *given: asked.append(given[7]) or cast(*given))
    echo(view, BOTH)
    dark = cross_sections.visible(cross_sections.DEFAULTS, view) == 0.0
    assert 0.2 < dark.mean() < 0.8
    np.testing.assert_array_equal(asked[0], dark)
    assert (asked[1] | ~dark).all()


def test_a_value_is_made_once_as_long_as_its_arrays_live():
    kept, calls, one, two = KeptByArrays(), [], np.ones(3), np.ones(3)

    def make():
        calls.append(None)
        return len(calls)

    assert [kept.of([one, two], make), kept.of([one, two], make), kept.of([two, one], make)] == [1, 1, 2]
    assert [kept.of([one, two], make, "other"), kept.of([one, two], make, "other")] == [3, 3]
    del two
    gc.collect()
    assert not kept._values
    assert kept.of([one, np.ones(3)], make) == 4


@pytest.mark.parametrize("effects", [BOTH, BOTH | {"reflected_aspect": {}}, {"ground_reflection": {}}])
def test_a_known_direct_echo_serves_the_echo_over_all_paths(effects):
    view = seen("DJI Mini 2")
    one, other = echo(view, effects), echo(view, effects)
    truth = one.subcarriers(view, frozenset(), one.routes)
    direct = other.direct.copy()
    found = other.subcarriers(view, frozenset(), other.routes)
    np.testing.assert_array_equal(other.direct, direct)
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-12 * abs(truth).max())
    assert abs(found - direct).max() > 1e-3 * abs(truth).max()
    # With squint the direct path's own echo is another.
    squinted = other.subcarriers(view, frozenset({"squint"}), other.routes)
    np.testing.assert_array_equal(squinted, one.subcarriers(view, frozenset({"squint"}), one.routes))


def test_a_known_direct_echo_is_not_worked_out_again(monkeypatch):
    view, pairs = seen("DJI Mini 2"), []
    moments = OneWayFactors.moments
    monkeypatch.setattr(
        OneWayFactors, "moments", lambda own, *given: pairs.append(len(own.pairs)) or moments(own, *given)
    )
    known = echo(view, BOTH)
    assert known.direct.any() and known.subcarriers(view, frozenset(), known.routes).any()
    other = echo(view, BOTH)
    assert other.subcarriers(view, frozenset(), other.routes).any()
    assert pairs == [1, 2, 3]


def test_the_largest_amplitude_of_a_path_is_that_of_its_coefficients():
    values = np.array([[3.0 + 4.0j, -1.0], [0.5j, 2.0 - 2.0j]])
    assert target_echo._largest(values) == 5.0 and target_echo._largest(np.asarray(-2.0 + 0j)) == 2.0
    assert target_echo._amplitude([ImagePath(values, values), ImagePath(values, 0.5)]) == 6.5
