"""The loader's order: every sample once, the same for any ranks, workers and stops."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.common.errors import InputError
from lowalt.shards import Batches


def together(parts):
    """The samples of all ranks in the order of the epoch: rank r of R takes every R-th of a step."""
    result = []
    for step in zip(*parts, strict=True):
        merged = np.full(sum(map(len, step)), -1)
        for rank, numbers in enumerate(step):
            merged[rank :: len(step)] = numbers
        result += merged.tolist()
    return result


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 200), st.integers(1, 12), st.integers(1, 5), st.integers(0, 3), st.integers(0, 2**40))
def test_ranks_share_every_sample_once(count, batch, ranks, epoch, seed):
    parts = [list(Batches(count, batch, seed, epoch, ranks, rank)) for rank in range(ranks)]
    assert {len(part) for part in parts} == {len(Batches(count, batch, seed, epoch, ranks))}
    assert together(parts) == Batches(count, 1, seed, epoch).order.tolist()
    assert sorted(together(parts)) == list(range(count))
    if count >= ranks:
        assert all(step for part in parts for step in part)


@settings(max_examples=100, deadline=None)
@given(st.data(), st.integers(1, 300), st.integers(1, 4))
def test_stopped_runs_go_on_where_they_were(data, count, ranks):
    """Stopped at any batch, and resumed with the same or another batch and number of ranks: same order, no loss."""
    batch, other_batch, other_ranks = (data.draw(st.integers(1, 9)) for _ in range(3))
    whole = [Batches(count, batch, 7, 2, ranks, rank) for rank in range(ranks)]
    done = data.draw(st.integers(0, len(whole[0])))
    before = together([list(part)[:done] for part in whole])
    assert before + together([list(part.resumed(done)) for part in whole]) == whole[0].order.tolist()
    start = whole[0].resumed(done).start
    others = [Batches(count, other_batch, 7, 2, other_ranks, rank, start) for rank in range(other_ranks)]
    assert before + together([list(part) for part in others]) == whole[0].order.tolist()


def test_a_hundred_stops_in_one_epoch():
    whole = Batches(1000, 8, 3, epoch=4)
    rng = np.random.default_rng(0)
    for stop in rng.integers(0, len(whole) + 1, 100):
        before = list(whole)[:stop]
        assert before + list(whole.resumed(int(stop))) == list(whole)


def test_orders_differ_by_epoch_and_seed_and_are_shuffled():
    first = Batches(5000, 10, seed=1)
    orders = [first.order, first.next_epoch().order, Batches(5000, 10, seed=2).order]
    for number, order in enumerate(orders):
        assert abs(np.corrcoef(order, np.arange(5000))[0, 1]) < 0.06
        assert all((order != other).mean() > 0.99 for other in orders[:number])
    np.testing.assert_array_equal(first.next_epoch().order, Batches(5000, 3, 1, epoch=1, ranks=4).order)


def test_a_torch_loader_reads_the_same_with_any_workers():
    data = pytest.importorskip("torch.utils.data")
    batches = Batches(50, 4, seed=5)
    found = [
        [batch.tolist() for batch in data.DataLoader(range(50), batch_sampler=batches, num_workers=workers)]
        for workers in (0, 2)
    ]
    assert found[0] == found[1] == list(batches)


@pytest.mark.parametrize("wrong", [{"batch": 0}, {"rank": 2}, {"start": 11}, {"epoch": -1}, {"count": -1}])
def test_wrong_numbers_are_refused(wrong):
    with pytest.raises(InputError, match="loader"):
        Batches(**{"count": 10, "batch": 2, "seed": 0, "ranks": 2, **wrong})
    with pytest.raises(InputError, match="batches done"):
        Batches(10, 2, 0).resumed(6)
