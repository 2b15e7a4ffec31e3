"""The tutorial on a target of your own runs as it is printed."""

import pytest

from followed_pages import SCHEMA, followed, linked_checkout
from lowalt.config.layers import load


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder with links to what a checkout holds, and the current folder of the test."""
    return linked_checkout(tmp_path, monkeypatch)


def test_a_target(checkout, monkeypatch):
    printed, names = followed("target", checkout, monkeypatch)
    assert "4 moving parts drafted" in printed and "5 parts" in printed
    assert (checkout / "mydrone.png").is_file()
    assert len(names["samples"].clouds["DJI Mini 2"].kinds) == 5
    config = load(["config/default.yaml", "config/tiny.yaml", "with_mine.yaml"], SCHEMA)
    assert (
        "My drone" in names["lowalt"].Dataset(config, inputs=config["inputs"]).plan.groups["unseen"]
    )
