"""The tutorial on a recording runs as it is printed."""

import pytest

from followed_pages import ROOT, followed, linked_checkout


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder with links to what a checkout holds, and the current folder of the test."""
    return linked_checkout(tmp_path, monkeypatch)


def test_a_recording(checkout, monkeypatch):
    (checkout / "results").mkdir()
    (checkout / "results/zoo").symlink_to(ROOT / "results/zoo")
    printed, names = followed("recording", checkout, monkeypatch)
    assert names["signals"].ndim >= 2
    assert len(list((checkout / "mine/tiles").glob("*.png"))) > 2
    assert "5 of 5 windows hold a target: UAV 0, Bird 0, Vehicle 0, Pedestrian 5" in printed
