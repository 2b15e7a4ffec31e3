"""Fixtures that several test files share."""

import math

import pytest

from meshes import write_bird, write_quad


@pytest.fixture
def mlcroissant(monkeypatch, tmp_path):
    """Croissant's reference implementation, unpacking into a folder of the test's own.

    It keeps unpacked archives by their relative names, so it would take one data set's shards for another's.
    """
    library = pytest.importorskip("mlcroissant")
    from mlcroissant._src.operation_graph.operations import extract

    monkeypatch.setattr(extract, "EXTRACT_PATH", type(extract.EXTRACT_PATH)(tmp_path / "croissant"))
    return library


@pytest.fixture
def always_approximate(monkeypatch):
    """Let the echo use the cheap plan of a tolerance even where the exact mode would be as fast."""
    from lowalt.echo import refine
    from lowalt.echo.slow_time import pose_series

    monkeypatch.setattr(refine, "PROBE_COST", -math.inf)
    monkeypatch.setattr(pose_series, "INTERPOLATION_COST", 1)


@pytest.fixture
def quad(tmp_path):
    """A folder with the meshes of a made quadcopter."""
    return write_quad(tmp_path)


@pytest.fixture
def bird(tmp_path):
    """A folder with the meshes of a made bird."""
    return write_bird(tmp_path)
