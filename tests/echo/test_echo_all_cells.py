"""All subcarriers at once: equal to the sum over points, also where points and paths are hundreds of cells apart."""

import numpy as np
import pytest
from test_echo import cloud_in_motion, network, positions

import reference
from lowalt.echo import Path, echo_matrix
from lowalt.echo.api import prepared
from lowalt.echo.pointwise.results import Paths, matrix
from lowalt.measure import echo_baselines


@pytest.mark.parametrize("count", [1, 7, 128])
@pytest.mark.parametrize("spread_m", [0.5, 40.0, 900.0])
def test_points_and_paths_far_apart_add_as_the_sum_over_points_says(count, spread_m):
    net, rng = network(subcarriers=count), np.random.default_rng(count)
    motion = cloud_in_motion(rng, 3, 9, (3000.0, 400.0, 300.0), spread_m)
    # From one range cell to several times the unambiguous range, point by point.
    paths = [Path(), Path(rng.uniform(0, 1e-6, (3, 9)), 0.4j), Path(3e-5, 0.2), Path(rng.uniform(0, 5e-5, (3, 9)), 0.3)]
    aim, seen = motion.translation[0, 0], net.stations[0]
    truth = reference.subcarriers(net, seen, positions(motion), np.ones(9), aim, paths)
    found = echo_matrix(net, seen, motion, 1.0, aim, "subcarriers", paths)
    assert abs(found - truth).max() < 1e-9 * abs(truth).max()
    cells = echo_matrix(net, seen, motion, 1.0, aim, "cells", paths)
    assert abs(cells - np.fft.ifft(truth, axis=1)).max() < 1e-9 * abs(cells).max()


def test_range_cells_are_those_of_the_closed_form_and_of_finufft():
    pytest.importorskip("finufft")
    net = network()
    motion = cloud_in_motion(np.random.default_rng(2), 40, 60, (150.0, -30.0, 60.0), 1.0)
    arguments = net, net.stations[0], motion, np.ones(60), motion.translation[0, 0]
    cells = echo_matrix(*arguments, "cells")
    scene, radio, refs, aims, _ = prepared(*arguments, None, "")
    closed = np.empty_like(cells)
    assert matrix(scene, radio, refs, aims, Paths(np.empty((0, 1, 1)), np.empty((0, 1, 1), complex)), closed) == 0
    assert abs(cells - closed).max() < 1e-14 * abs(closed).sum(axis=1).max()
    assert abs(cells - echo_baselines.finufft_cells(*arguments, 1e-12)).max() < 1e-9 * abs(cells).max()
