"""The plan of a run that grows: every sample stands in one chunk, and no step moves what stood
before it.
"""

import itertools

import numpy as np
import pytest

from configured import ROOT
from lowalt.config.blocks import snrs_of
from lowalt.config.layers import load_yaml, merge
from lowalt.config.network import Network, as_far_as
from lowalt.files.errors import InputError
from lowalt.motion.drawing import masts_in_reach
from lowalt.shards.dataset import Dataset
from lowalt.shards.plan import Plan
from tables import rows

PUBLISHED = {
    name: {"unseen_protocol": group}
    for name, group in zip("abcdef", ["seen", "unseen"] * 3, strict=True)
}
STEPS = [{"snr_db": [13]}, {"subtypes": ["d", "e"]}, {"subtypes": ["f"], "snr_db": [3, -5]}]


@pytest.fixture
def config():
    return merge(
        load_yaml(ROOT / "config/default.yaml"),
        {
            "targets": {"select": ["a", "b", "c"]},
            "motion": {"models": 25, "models_per_chunk": 10},
            "noise": {"snr_db": [8, float("inf")]},
        },
    )


def held(plan, names):
    """The samples (subtype, model, SNR) of chunks."""
    chunks = [plan.chunk(name) for name in names]
    return [
        sample
        for chunk in chunks
        for sample in itertools.product(
            chunk.members, range(chunk.first, chunk.first + chunk.count), chunk.snrs
        )
    ]


@pytest.mark.parametrize("count", range(4))
def test_all_samples_stand_in_one_chunk_each_whatever_is_added(config, count):
    config["added"] = STEPS[:count]
    plan = Plan.of(config, PUBLISHED)
    subtypes = sorted(itertools.chain(*plan.groups.values()))
    assert subtypes == list("abcdef")[: {0: 3, 1: 3, 2: 5, 3: 6}[count]]
    assert sorted(held(plan, plan.chunks)) == sorted(
        itertools.product(subtypes, range(25), snrs_of(config))
    )
    # Motion models do not depend on SNRs: each stands in one table.
    moved = [(name, model) for name, model, _ in held(plan, plan.sources)]
    assert sorted(set(moved)) == sorted(itertools.product(subtypes, range(25)))
    for name in plan.chunks:
        chunk, source = plan.chunk(name), plan.chunk(plan.chunk(name).source)
        assert (chunk.members, chunk.first, chunk.count) == (
            source.members,
            source.first,
            source.count,
        )


def test_groups_are_the_table_s(config):
    plan = Plan.of(config | {"added": STEPS}, PUBLISHED)
    assert plan.groups == {"seen": ("a", "c", "e"), "unseen": ("b", "d", "f")}
    for name in plan.chunks:
        assert {PUBLISHED[member]["unseen_protocol"] for member in plan.chunk(name).members} == {
            name.split("-")[0]
        }


def test_a_step_moves_no_chunk_that_was_there(config):
    plans = []
    for count in range(4):
        plans.append(Plan.of(config | {"added": STEPS[:count]}, PUBLISHED))
    for before, after in itertools.pairwise(plans):
        assert {before.chunk(name) for name in before.chunks} < {
            after.chunk(name) for name in after.chunks
        }
        assert set(before.shards) < set(after.shards)
    more = Plan.of(merge(config, {"motion": {"models": 40}}) | {"added": STEPS}, PUBLISHED)
    whole = {name for name in plans[-1].chunks if plans[-1].chunk(name).count == 10}
    assert {plans[-1].chunk(name) for name in whole} < {more.chunk(name) for name in more.chunks}


@pytest.mark.parametrize(
    ("steps", "words"),
    rows("plans", "steps"),
)
def test_what_is_there_already_is_not_added(config, steps, words):
    with pytest.raises(InputError, match=words):
        Plan.of(config | {"added": steps}, PUBLISHED)


def test_a_station_hears_the_same_without_those_that_stand_after_it():
    block = load_yaml(ROOT / "config/default.yaml")["network"]
    block["stations"]["AC"] = {"transmit": "A", "receive": "C"}
    whole = Network.from_settings(block)
    for name in block["stations"]:
        part = Network.from_settings(as_far_as(block, name))
        assert part.station(name) == whole.station(name)
    assert sorted(as_far_as(block, "B")["stations"]) == ["A", "B"]
    assert sorted(as_far_as(block, "AC")["stations"]) == ["A", "AC", "B", "C"]


def test_masts_out_of_reach_change_no_motion_model():
    config = load_yaml(ROOT / "config/tiny.yaml")
    region = {"polygon_m": [[100, 60], [250, 300], [400, 60]], "mast_clearance_m": 30.0}
    masts = [[0, 0], [250, 100], [90, 60], [400, 200], [800, 800]]
    near = masts_in_reach(masts, **region)
    assert near == [[250, 100], [90, 60]]
    assert masts_in_reach(masts, None, 30.0) == masts
    config = merge(
        load_yaml(ROOT / "config/default.yaml"),
        config | {"motion": {"models": 10, "models_per_chunk": 10}},
    )
    config = merge(config, {"motion": {"region": region}})
    rows = []
    clouds = None
    for masts_m in (masts, near):
        stations = {
            f"S{n}": {"position_m": [*mast, 25.0], "normal_deg": 0.0}
            for n, mast in enumerate(masts_m)
        }
        config["network"]["stations"] = stations
        dataset = Dataset(config, clouds, inputs=None)
        clouds = dataset.clouds
        rows.append([dataset.row(dataset.place(number)) for number in range(0, len(dataset), 7)])
    for one, other in zip(*rows, strict=True):
        assert str(one) == str(other)
    assert np.isfinite(rows[0][0]["x_m"])
