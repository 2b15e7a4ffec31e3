"""Settings that rules take of their stages (`lowalt.workflow.stages`), and the report's manifest."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from configured import Stages, stages_of
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
    before = settings(stages_of(), job)
    after = settings(stages_of(overlay), job)
    assert {name for name in before if before[name] != after[name]} == changed | WHOLE


WHOLE = {"configuration", "report"}
"""Settings that hold the whole configuration: next to the results, and of the report."""


def settings(stages: Stages, job: SimpleNamespace) -> dict[str, str]:
    """The settings of every stage for a job of it."""
    return {
        "cloud": stages.targets.settings(job),
        "motion": stages.motion.settings(job),
        "echo": stages.echo.settings(job),
        "echo_in_scene": stages.echo.settings_in_scene(job),
        "noise": stages.noise.settings(job),
        "images": stages.tiles.settings(job),
        "shard": stages.shards.settings(job),
        "configuration": stages.shards.configuration(job),
        "cost_table": stages.cost.settings(job),
        "views": stages.recognition.view_settings(job),
        "training": stages.recognition.training(job),
        "evaluation": stages.recognition.evaluation(job),
        "seed": stages.recognition.seed(job),
        "report": stages.page.settings(job),
    }


def test_settings_of_different_jobs_differ_and_are_json():
    stages = stages_of()
    one, other = (
        SimpleNamespace(run="default", group=group, part="00000") for group in ("seen", "unseen")
    )
    drawn = [set(json.loads(stages.motion.settings(job))["published"]) for job in (one, other, one)]
    assert drawn[0] == drawn[2] and drawn[0].isdisjoint(drawn[1])
    written = json.loads(stages.shards.configuration(one))
    assert written == plain(load_yaml("config/default.yaml"))


def test_tiles_of_range_cells_follow_the_seed_and_the_snrs():
    """Their noise is drawn from both; tiles of signals alone need neither."""
    cells = {"spectra": {"hrrp": {"window": 1, "hop": 1, "cells": 9}}}
    for block, different in (({}, 1), (cells, 3)):
        texts = set()
        for change in ({}, {"seed": 2}, {"noise": {"snr_db": [3.0]}}):
            texts.add(stages_of(block | change).tiles.settings(CHUNK))
        assert len(texts) == different


def test_the_report_s_files_are_a_manifest_that_the_report_takes():
    shown = {"cost": "config/schemes.csv", "accuracy": "config/cost/accuracy.csv"}
    more = {"report": shown, "recognition": {"transfer": ["other"]}}
    for overlay, names in (({}, set()), (more, {"transfer", "accuracy_cost", "echo_cost"})):
        files = ReportInputs(stages_of(overlay).page.files(CHUNK)).files
        kept = {name for name in files if name.startswith("kept_")}
        assert kept == {f"kept_{name}" for name in KEPT}
        assert names == (set(files) & set(OPTIONAL)) - {"published", "predictions"} - kept
        assert len(files["clouds"]) == 40 and files["index"] == "results/default/shards/index.json"
    page = stages_of({"run": "lowalt-40-v1"}).page
    assert page.files(CHUNK)["benchmark"].endswith("lowalt-40-v1/table.csv")
    assert "src/lowalt/report/sections/accuracy.html" in page.templates
