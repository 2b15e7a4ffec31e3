"""Settings of stages (`lowalt.workflow.stage_settings`), options of commands and the report's
manifest.
"""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from configured import parts
from lowalt.config.layers import plain
from lowalt.files.yaml_files import load_yaml
from lowalt.report.inputs import KEPT, OPTIONAL
from lowalt.report.inputs import Inputs as ReportInputs

ROOT = Path(__file__).parents[2]


CHUNK = SimpleNamespace(run="default", group="seen", part="00001", station="B", fold="train")


@pytest.mark.parametrize(
    ("overlay", "changed"),
    [
        ({"motion": {"tilt_deg": 10.0}}, {"motion", "cost_table"}),
        ({"noise": {"snr_db": [9]}}, {"noise", "shard", "views"}),
        ({"tiles": {"reduced": [48]}}, {"views"}),
        ({"images": {"gamma": 0.7}}, {"images"}),
        ({"images": {"colour_map": "magma"}}, {"images", "training"}),
        ({"recognition": {"training": {"steps": 7}}}, {"training"}),
        ({"recognition": {"evaluation": {"batch": 7}}}, {"evaluation"}),
        ({"split": {"val": 2, "train": 7}}, {"shard"}),
        ({"echo": {"tolerance": 1e-3}}, {"echo", "echo_in_scene"}),
    ],
)
def test_a_changed_value_changes_the_settings_of_the_stages_that_read_it(overlay, changed):
    job = SimpleNamespace(
        **vars(CHUNK),
        subtype="crow",
        size="24",
        scheme="a-vrp-trp-vt",
        train_seed="3",
        get=lambda key, default: 3,
    )
    names = (
        "cloud",
        "motion",
        "echo",
        "echo_in_scene",
        "noise",
        "images",
        "shard",
        "cost_table",
        "views",
        "training",
        "evaluation",
        "seed",
    )
    before = parts()[2]
    after = parts(overlay)[2]
    assert {
        name for name in names if getattr(before, name)(job) != getattr(after, name)(job)
    } == changed
    # The whole configuration stands next to the results and in the report.
    assert before.configuration(job) != after.configuration(job) and before.report(
        job
    ) != after.report(job)


def test_settings_of_different_jobs_differ_and_are_json():
    _, _, settings = parts()
    one, other = (
        SimpleNamespace(run="default", group=group, part="00000") for group in ("seen", "unseen")
    )
    drawn = [set(json.loads(settings.motion(job))["published"]) for job in (one, other, one)]
    assert drawn[0] == drawn[2] and drawn[0].isdisjoint(drawn[1])
    assert json.loads(settings.configuration(one)) == plain(load_yaml("config/default.yaml"))


def test_tiles_of_range_cells_follow_the_seed_and_the_snrs():
    """Their noise is drawn from both; tiles of signals alone need neither."""
    job = CHUNK
    cells = {"spectra": {"hrrp": {"window": 1, "hop": 1, "cells": 9}}}
    changes = [{}, {"seed": 2}, {"noise": {"snr_db": [3.0]}}]
    plain, of_cells = (
        [parts({**block, **change})[2].images(job) for change in changes] for block in ({}, cells)
    )
    assert len(set(plain)) == 1 and len(set(of_cells)) == 3


def test_the_report_s_files_are_a_manifest_that_the_report_takes():
    shown = {"cost": "config/schemes.csv", "accuracy": "config/cost/accuracy.csv"}
    more = {"report": shown, "recognition": {"transfer": ["other"]}}
    for overlay, names in (({}, set()), (more, {"transfer", "accuracy_cost", "echo_cost"})):
        _, products, _ = parts(overlay)
        files = ReportInputs(products.report(CHUNK)).files
        kept = {name for name in files if name.startswith("kept_")}
        assert kept == {f"kept_{name}" for name in KEPT}
        assert names == (set(files) & set(OPTIONAL)) - {"published", "predictions"} - kept
        assert len(files["clouds"]) == 40 and files["index"] == "results/default/shards/index.json"
    assert (
        parts({"run": "lowalt-40-v1"})[1]
        .report(CHUNK)["benchmark"]
        .endswith("lowalt-40-v1/table.csv")
    )
    assert "src/lowalt/report/sections/accuracy.html" in products.page_templates(CHUNK)
