"""Side channels of a data set.

Those said to be closed give chance, those that are forbidden give the class.
"""

import csv
import re
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from dataset import build
from lowalt.config.layers import SCHEMA, load, merge
from lowalt.shards import ShardSet
from lowalt.tiles.png import decode, encode

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "benchmarks"))
side_channels = import_module("side_channels")
KEPT = list(csv.DictReader((ROOT / "results/benchmarks/side_channels.csv").open(newline="")))
RULES = (ROOT / "docs/benchmark-rules.md").read_text()
WITHOUT_DATA = ("motion models absent from training", "row of `lowalt.extensions.benchmark.load`")
"""Channels that are measured on the list of the benchmark's samples."""
SURE = 0.001
"""The least p-value, that of a classifier which beats all random assignments."""


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A data set of eight subtypes, twenty motion models each, with and without noise."""
    fewer = {"motion": {"models": 20}, "images": {"size": 64}}
    config = merge(load(["config/default.yaml", "config/tiny.yaml"], SCHEMA), fewer)
    return side_channels.evidence(config, tmp_path_factory.mktemp("channels"))


@pytest.mark.slow
def test_every_channel_gives_what_its_verdict_says(found):
    rows = [
        dict(zip(side_channels.COLUMNS, row, strict=True)) for row in side_channels.measured(found)
    ]
    assert len(rows) == len(KEPT) - len(WITHOUT_DATA)
    for row in rows:
        assert (float(row["p_value"]) <= SURE) == (row["verdict"] != "chance"), row


@pytest.mark.slow
def test_no_sample_stands_in_two_folds_and_all_of_a_motion_model_are_in_one(found):
    signals = {}
    folds = {}
    for number, record in enumerate(found.records):
        signal = found.shards.signal(number)
        assert signals.setdefault(signal.tobytes(), record["key"]) == record["key"]
        model = record["subtype"], record["model"]
        assert folds.setdefault(model, record["fold"]) == record["fold"]
    assert len(signals) == len(found.records) and set(folds.values()) == {"train", "val", "test"}


def test_kept_figures_agree_with_their_verdicts_and_with_the_rules():
    written = re.findall(
        r"^\| ([^|]+) \| ([\d.]+) \| (no rule needed|forbidden)", RULES, re.MULTILINE
    )
    words = {"in the image": "no rule needed", "forbidden": "forbidden"}
    # The page leaves out the channels that tell nothing.
    telling = [row for row in KEPT if row["verdict"] != "chance"]
    assert written == [
        (row["channel"], row["accuracy_percent"], words[row["verdict"]]) for row in telling
    ]
    assert {row["verdict"] for row in telling} == set(words) and len(telling) < len(KEPT)
    for row in KEPT:
        assert (float(row["p_value"]) <= SURE) == (row["verdict"] != "chance"), row
    for line in RULES.splitlines():
        if "| forbidden" in line:
            (number,) = re.findall(r"\| forbidden by rule (\d)", line)
            assert re.search(rf"^{number}\. ", RULES, re.MULTILINE)


def test_the_size_of_an_image_s_file_follows_from_its_pixels(tmp_path):
    shards = ShardSet(build(tmp_path / "shards", "image") / "index.json")
    for number in range(len(shards)):
        stored = shards.png(number)
        assert encode(*decode(stored)) == stored


def test_a_channel_that_leaks_is_seen_and_one_that_does_not_is_not():
    """Forty motion models of each class with two samples each.

    They are returned in the order of the classes, and shuffled.
    """
    labels = np.repeat(np.arange(4), 80)
    groups = np.repeat(np.arange(160), 2)
    order = np.arange(320.0).reshape(-1, 1)
    shuffled = np.random.default_rng(5).permutation(order)
    values = {}
    for name, features in (("ordered", order), ("shuffled", shuffled)):
        answers = side_channels.learned(features, labels, groups)
        values[name] = side_channels.chance_of(answers, labels, groups)
    assert values["ordered"] <= SURE < 0.01 < values["shuffled"]


def test_the_number_of_a_motion_model_names_the_class_to_whoever_knows_what_trains():
    config = load(["config/default.yaml", "config/lowalt-40-v1.yaml"], SCHEMA)
    row = dict(zip(side_channels.COLUMNS, side_channels.by_number(config), strict=True))
    (kept,) = [kept for kept in KEPT if kept["channel"] == row["channel"]]
    assert kept == {name: str(value) for name, value in row.items()}


def test_the_row_of_a_sample_tells_nothing_of_its_class():
    row = dict(zip(side_channels.COLUMNS, side_channels.by_row(), strict=True))
    (kept,) = [kept for kept in KEPT if kept["channel"] == row["channel"]]
    assert kept == {name: str(value) for name, value in row.items()}
    assert row["verdict"] == "chance" and float(row["p_value"]) > SURE
