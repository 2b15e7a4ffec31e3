"""Options of commands, and what rules take of their stages in scenes (`lowalt.workflow.stages`)."""

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from configured import Stages, run_of, stages_of
from lowalt.config.layers import merge
from lowalt.files.atomic import slug
from lowalt.workflow.stages.noise import NoiseStage
from lowalt.workflow.stages.shards import ShardsStage
from lowalt.workflow.stages.tiles import TilesStage

CHUNK = SimpleNamespace(run="default", group="seen", part="00001", station="B", fold="train")


def test_every_value_in_a_command_of_a_rule_is_quoted_and_rules_run_nothing_but_commands():
    text = "\n".join(
        path.read_text() for path in [Path("Snakefile"), *Path("workflow/rules").glob("*.smk")]
    )
    commands = "".join(re.findall(r"^    shell:\n((?:        .*\n)+)", text, re.MULTILINE))
    fields = re.findall(r"(?<!\{)\{([^{}]+)\}(?!\})", commands)
    assert len(fields) > 100 and {field for field in fields if not field.endswith(":q")} == {
        "threads"
    }
    assert not re.findall(r"^    (?:script|run|notebook|wrapper|cwl):", text, re.MULTILINE)


BESIDE = {"echo_in_scene": {"echo"}, "occluders": set(), "common": {"stage"}}
"""Rule files whose stage is not named after them: the modules of stages that they import."""


@pytest.mark.parametrize(
    "path", sorted(Path("workflow/rules").glob("*.smk")), ids=lambda one: one.stem
)
def test_a_rule_file_begins_with_the_module_of_its_stage_alone(path):
    imported = re.findall(r"^from lowalt\.workflow\.stages\.(\w+) import", path.read_text(), re.M)
    assert {*imported} == BESIDE.get(path.stem, {path.stem})


def modules(stage, **config):
    """The modules that a stage loads for a configuration with these blocks."""
    return stage(SimpleNamespace(config={"effects": {}, "spectra": {}, **config})).modules


def test_a_stage_loads_an_effect_s_module_only_in_its_scene():
    known = {"times": "known"}
    late = {"slow_time": {"jitter_s": 1e-4}}
    slow_time = "lowalt.scene.effects.transmitter.slow_time"
    of_late = modules(TilesStage, spectra=known, effects=late)
    assert of_late == ["lowalt.scene.lateness", "lowalt.motion", slow_time]
    assert modules(TilesStage, effects=late) == []
    assert modules(TilesStage, spectra=known) == []
    assert modules(TilesStage, spectra=known, effects={"slow_time": {"downlink": 1}}) == []
    of_cells = modules(TilesStage, spectra=known | {"hrrp": {"window": 1}}, effects=late)
    assert of_cells == [*of_late, "lowalt.tiles.cubes", slow_time]
    for kind, expected in (("cube", ["lowalt.scene.effects.receiver.adc"]), ("image", [])):
        assert modules(ShardsStage, effects={"adc": {}}, shards={"kind": kind}) == expected
    assert modules(NoiseStage, effects={"canceller": None}) == [
        "lowalt.scene.set_noise",
        "lowalt.scene.effects.detection.canceller",
    ]
    assert modules(NoiseStage, effects={"adc": None}) == []


def scene(effects, **more):
    """The stages of the default run with effects, whether or not they fit together."""
    run = run_of()
    return Stages(replace(run, config=merge(run.config, {"effects": effects, **more})))


def test_settings_name_an_effect_for_the_stages_that_read_it_alone():
    plain = scene({})
    cancelled = scene({"canceller": {"kind": "mean"}})
    assert "filters" not in json.loads(plain.noise.settings(CHUNK))
    assert not cancelled.tiles.reads_motion
    written = json.loads(cancelled.noise.settings(CHUNK))
    assert written["filters"] == {"canceller": {"kind": "mean"}}
    assert "filters" not in json.loads(cancelled.shards.settings(CHUNK))
    usual = scene({"canceller": None})
    assert json.loads(usual.noise.settings(CHUNK))["filters"] == {"canceller": {}}
    beside = scene({"companions": None})
    assert json.loads(beside.shards.settings(CHUNK))["record"] == {"companions": {}}
    assert "record" not in json.loads(plain.shards.settings(CHUNK))
    recipe = scene({"canceller": {"kind": "mean"}}, shards={"kind": "recipe"})
    assert json.loads(recipe.shards.settings(CHUNK))["filters"]["canceller"]["kind"] == "mean"
    no_canceller = scene({}, shards={"kind": "recipe"})
    assert "filters" not in json.loads(no_canceller.shards.settings(CHUNK))


def test_late_symbols_tell_the_tiles_their_draws_and_other_scenes_do_not():
    late = {"slow_time": {"jitter_s": 1e-4}}
    tiles = scene(late, spectra={"times": "known"}).tiles
    assert tiles.reads_motion and not tiles.shows_cells
    drawn = json.loads(tiles.settings(CHUNK))["drawn"]
    assert set(drawn) == {"seed", "effects"} and list(drawn["effects"]) == ["slow_time"]
    tiles = scene(late).tiles
    assert not tiles.reads_motion and "drawn" not in json.loads(tiles.settings(CHUNK))


def test_an_echo_in_a_scene_knows_set_snrs_where_all_cells_hold_noise():
    assert "snr_db" not in json.loads(scene({"adc": {}}).echo.settings_in_scene(CHUNK))
    assert "snr_db" in json.loads(scene({"cell_noise": {}}).echo.settings_in_scene(CHUNK))


def test_an_echo_s_settings_hold_its_own_station_and_those_of_all_stations_otherwise():
    echo = scene({}).echo
    alone = echo.settings(CHUNK)
    all_of_them = echo.settings(SimpleNamespace(run="default", group="seen", part="00001"))
    stations = [list(json.loads(text)["network"]["stations"]) for text in (alone, all_of_them)]
    assert "B" in stations[0] and stations[1] == ["A", "B", "C"] and alone != all_of_them


def test_added_levels_are_the_settings_of_their_own_chunks():
    stages = stages_of({"noise": {"snr_db": [3, 8]}, "added": [{"snr_db": [1.5]}]})
    levels = set()
    for name in stages.run.plan.chunks:
        group, part = name.split("-", 1)
        job = SimpleNamespace(group=group, part=part)
        levels.add(tuple(json.loads(stages.noise.settings(job))["snr_db"]))
        assert stages.noise.source(job) in stages.run.plan.sources
    assert levels == {(3, 8), (1.5,)}


def test_a_shard_s_command_counts_the_pieces_of_its_fold_from_zero():
    shards = stages_of({"shards": {"largest_mb": 100}}).shards
    job = {"group": "seen", "part": "00001", "fold": "train"}
    words = [shards.piece(SimpleNamespace(**job, piece=piece)) for piece in ("p0", "p1")]
    assert [number for _, number, _ in words] == ["0", "1"]
    alone = stages_of({"shards": {"largest_mb": 1e6}}).shards
    assert alone.piece(SimpleNamespace(**job, piece="")) == []


def test_companions_bring_their_clouds_once():
    groups = run_of().plan.groups
    one = groups["seen"][0]
    other = groups["unseen"][0]
    echo = scene({"companions": {"subtypes": [other, one, other]}}).echo
    own = echo.subtypes(CHUNK)
    assert echo.scene_subtypes(CHUNK) == [*own, slug(other)]
    assert scene({"companions": None}).echo.scene_subtypes(CHUNK) == own


def test_trainings_are_those_of_each_scheme_s_protocols_and_seeds(tmp_path):
    table = tmp_path / "table.csv"
    table.write_text(
        "scheme,stations,spectra,fusion,backbone,protocols\nfew,A,VRP,attention,,seen+unseen\n"
        "more,AB,VRP,attention,,seen\nother,ABC,VRP,attention,,unseen\n"
    )
    block = {"table": str(table), "schemes": ["few", "more", "other"], "timed": [], "seeds": [4, 5]}
    assert run_of({"recognition": block}).trainings == [
        f"{name}/{seed}"
        for name in ("seen/few", "unseen/few", "seen/more", "unseen/other")
        for seed in (4, 5)
    ]
