"""Fixtures that several test files share."""

import math

import pytest


@pytest.fixture
def always_approximate(monkeypatch):
    """Let the echo use the cheap plan of a tolerance even where the exact mode would be as fast."""
    from lowalt.echo import refine
    from lowalt.echo.slow_time import pose_series

    monkeypatch.setattr(refine, "PROBE_COST", -math.inf)
    monkeypatch.setattr(pose_series, "INTERPOLATION_COST", 1)
