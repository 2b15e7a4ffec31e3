"""The simulated queue of a cluster: its time and length follow the graph, the nodes and the limit."""

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("snakemake")
sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

from job_graph import queue


@pytest.mark.parametrize(
    ("slots", "most", "expected"),
    [
        (1, 100, (15.0, 3)),
        (2, 100, (11.0, 3)),
        (2, 2, (11.0, 2)),
        (9, 1, (15.0, 1)),
        (9, 100, (8.0, 3)),
    ],
)
def test_a_small_graph_takes_the_time_found_by_hand(slots, most, expected):
    """One submission of 2 s, then three of 3, 4 and 5 s, and one of 1 s after all of them."""
    assert queue([2, 3, 4, 5, 1], [set(), {0}, {0}, {0}, {1, 2, 3}], slots, most) == expected


def test_no_queue_is_faster_than_its_longest_chain_or_its_work_shared_evenly():
    rng = np.random.default_rng(5)
    for _ in range(30):
        count, slots, most = (int(number) for number in rng.integers(1, 30, 3))
        seconds = rng.uniform(1, 9, count).tolist()
        before = [set(np.flatnonzero(rng.random(place) < 0.2).tolist()) for place in range(count)]
        chains: list[float] = []
        for place in range(count):
            chains.append(
                seconds[place] + max((chains[other] for other in before[place]), default=0.0)
            )
        found, largest = queue(seconds, before, slots, most)
        least = max(*chains, sum(seconds) / min(slots, most))
        # Graham's bound (1966): no slot is empty while a submission is ready, so both together are
        # never exceeded.
        assert least - 1e-9 <= found <= max(chains) + sum(seconds) / min(slots, most) + 1e-9
        assert 1 <= largest <= most
