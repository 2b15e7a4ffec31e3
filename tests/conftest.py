"""Fixtures that several test files share."""

import math

import pytest


@pytest.fixture
def cheap_at_any_price(monkeypatch):
    """Let the echo engine use what a tolerance allows even where the exact mode would be as fast."""
    from lowalt.echo import ladder, slow

    monkeypatch.setattr(ladder, "TRYING", -math.inf)
    monkeypatch.setattr(slow, "WORTH", 1)
