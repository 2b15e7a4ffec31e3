"""Distances of a view: bounds hold for every point of every part, from every end of the way."""

import numpy as np
import pytest

from lowalt.effects.received import Scene, observe
from test_effects import network, target
from test_effects_links import B, link, linked


@pytest.mark.parametrize("station", [link(), link(B, link().transmitter), link().transmitter])
def test_no_point_is_nearer_to_any_end_than_the_bound_of_its_part(station):
    cloud, row = target(np.random.default_rng(8))
    view = observe(Scene(linked(symbols=4), 5, None, ()), station, cloud, row)
    ends = [end for end in (station, station.transmitter) if end is not None]
    ranges = np.min([np.linalg.norm(view.places - np.asarray(end.position_m), axis=2) for end in ends], axis=0)
    bound = view.nearest_m()
    assert (bound[:, cloud.part] <= ranges + 1e-9).all()
    # The middle of a part lies at most a radius behind its nearest point, so the bound is not far below.
    assert (bound.min(axis=1) >= ranges.min(axis=1) - 2 * view.radii.max()).all()


def test_other_points_places_are_all_that_is_known_of_them():
    cloud, row = target(np.random.default_rng(4))
    view = observe(Scene(network(), 5, None, ()), network().stations[0], cloud, row)
    some = view.places[:, 2:5]
    assert view.normals.shape[1] == 9
    other = view.with_places(some)
    assert other.places is some and other.station is view.station and "normals" not in other.__dict__
