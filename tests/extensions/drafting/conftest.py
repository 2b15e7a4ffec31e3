"""Fixtures of the tests of drafted targets."""

import pytest

from lowalt.report.figures import target_picture


@pytest.fixture
def without_target_picture(monkeypatch):
    """`target make` writes a word for its picture, whose drawing takes far longer than a cloud and
    has tests of its own.
    """
    monkeypatch.setattr(target_picture, "target_picture", lambda cloud: b"picture")
