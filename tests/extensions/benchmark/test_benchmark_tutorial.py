"""The tutorial on a submission to the benchmark runs as it is printed."""

from pathlib import Path

import pytest
import small_benchmark

import lowalt
import lowalt.extensions.benchmark
from followed_pages import followed, linked_checkout
from lowalt.commands import workflow
from lowalt.extensions.benchmark import frozen_bytes
from lowalt.extensions.benchmark.submission import read as read_submission


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder with links to what a checkout holds, and the current folder of the test."""
    return linked_checkout(tmp_path, monkeypatch)


def test_a_submission_to_the_benchmark(checkout, monkeypatch):
    """The tutorial runs on a small copy of the benchmark.

    Its data come from the test, so that no workflow starts and no byte is kept.
    """
    small_benchmark.shrink(monkeypatch)
    monkeypatch.setattr(
        workflow,
        "ended",
        lambda options: {"status": small_benchmark.write(Path("results")) is None},
    )
    monkeypatch.setattr(frozen_bytes, "compared", lambda part, folder: [])
    printed, _ = followed("benchmark", checkout, monkeypatch)
    assert (
        "are equal to the kept checksums" in printed and "16 samples, training seeds: 1" in printed
    )
    test = lowalt.extensions.benchmark.load("unseen", "test")
    right = read_submission("mine.csv", test.track).argmax(1) == test.labels
    assert f"accuracy {100 * right.mean():.1f} (" in printed
    small_benchmark.clear()
