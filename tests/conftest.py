"""Fixtures that several test files share."""

import math

import pytest


@pytest.fixture
def cheap_at_any_price(monkeypatch):
    """Let the echo engine use what a tolerance allows even where the exact mode would be as fast."""
    from lowalt.echo import refine
    from lowalt.echo.slow_time import pose_series

    monkeypatch.setattr(refine, "TRYING", -math.inf)
    monkeypatch.setattr(pose_series, "WORTH", 1)
