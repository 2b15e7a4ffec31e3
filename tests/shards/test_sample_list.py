"""The list of samples says of each what its record says, and it is read without making one."""

import numpy as np
import pytest

from lowalt.config.layers import SCHEMA, load, merge
from lowalt.shards.dataset import Dataset
from lowalt.shards.plan import Plan
from lowalt.shards.sample_list import SampleList
from lowalt.targets.records import records_of

LESS = {"motion": {"models": 10}, "targets": {"select": ["Crow", "Owl"]}}


@pytest.mark.parametrize("by", ["motion", "sample"])
def test_columns_are_those_of_the_records(by):
    config = merge(load(["config/default.yaml", "config/tiny.yaml"], SCHEMA), LESS)
    config["split"]["by"] = by
    data = Dataset(config, folds=("train", "test"))
    columns = data.listed.columns()
    assert {len(column) for column in columns.values()} == {len(data)}
    for number in range(0, len(data), 3):
        record = data.record(number)
        for name in ("key", "subtype", "model", "snr_db", "group", "fold", "label"):
            assert columns[name][number] == record[name]
    assert set(columns["fold"].tolist()) == {"train", "test"}


def test_a_list_has_the_samples_of_its_plan_and_no_other():
    config = load(["config/default.yaml", "config/tiny.yaml"], SCHEMA)
    published = {
        name: record["published"] for name, record in records_of(config["targets"]).items()
    }
    plan = Plan.of(config, published)
    listed = SampleList(plan, published)
    keys = [place.key for place in listed]
    assert len(listed) == len(set(keys)) == plan.samples
    folds = [SampleList(plan, published, folds=[fold]) for fold in ("train", "val", "test")]
    assert sorted(place.key for part in folds for place in part) == sorted(keys)
    assert [place.group for place in SampleList(plan, published, ["unseen"])] == ["unseen"] * (
        len(keys) // 2
    )
    assert np.array_equal(listed.labels, listed.columns()["label"])
