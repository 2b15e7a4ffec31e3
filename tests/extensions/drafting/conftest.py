"""Fixtures of the tests of drafted targets."""

import pytest

from lowalt.report.figures import target_picture


@pytest.fixture
def without_target_picture(monkeypatch):
    """`target make` writes a word for its picture.

    To draw it takes far longer than to make a cloud, and has tests of its own.
    """
    monkeypatch.setattr(target_picture, "target_picture", lambda cloud: b"picture")
