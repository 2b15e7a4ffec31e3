"""Grids of triangles for rays: none is lost while the target moves on."""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.effects.channel import occlusion, shadow_rays
from lowalt.targets.surfaces import Surface
from test_effects_occlusion import NETWORK, scene


@pytest.mark.parametrize("range_m", [30.0, 80.0])
def test_a_grid_loses_no_triangle_while_the_target_flies_on(range_m, monkeypatch):
    # Small triangles, of which a ray rarely meets two: one that a cell lacks is missed.
    rng = np.random.default_rng(5)
    corners = rng.uniform(-1.5, 1.5, (900, 1, 3)) + rng.normal(0, 0.06, (900, 3, 3))
    surface = Surface(corners.reshape(-1, 3), np.arange(2700).reshape(-1, 3))
    points = rng.uniform(-1.5, 1.5, (300, 3))
    view = scene(
        points, rng.normal(0, 1, (300, 3)), [surface], np.zeros(300, int), closed=False, x_m=range_m, z_m=50.0,
        vx_mps=-9.0, vy_mps=28.0, yaw_rad=0.4, pitch_rad=0.3,
    )  # fmt: skip
    view = replace(view, times_s=NETWORK.times_s[:64])
    found = occlusion.hidden(view)
    monkeypatch.setattr(shadow_rays, "SLOW", 0.0)
    assert (found == occlusion.hidden(view)).all()
    assert 0.05 < found.mean() < 0.9
    assert len(np.unique(found, axis=0)) > 5
