"""Options of commands and settings of stages in scenes (`lowalt.workflow.options`,
`stage_settings`).
"""

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

from configured import parts, run_of
from lowalt.config.layers import merge
from lowalt.files.atomic import slug
from lowalt.workflow import options
from lowalt.workflow.products import Products
from lowalt.workflow.stage_settings import Settings

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


def test_a_stage_loads_an_effect_s_module_only_in_its_scene():
    late = {"spectra": {"times": "known"}, "effects": {"slow_time": {"jitter_s": 1e-4}}}
    assert options.tile_modules(late) == [
        "lowalt.scene.lateness",
        "lowalt.motion",
        "lowalt.scene.effects.transmitter.slow_time",
    ]
    for other in (
        late | {"spectra": {}},
        late | {"effects": {}},
        late | {"effects": {"slow_time": {"downlink": 1}}},
    ):
        assert options.tile_modules(other) == []
    cells = late | {"spectra": {"times": "known", "hrrp": {"window": 1}}}
    assert options.tile_modules(cells)[:3] == options.tile_modules(late)
    assert options.tile_modules(cells)[3:] == [
        "lowalt.tiles.cubes",
        "lowalt.scene.effects.transmitter.slow_time",
    ]
    for kind, modules in (("cube", ["lowalt.scene.effects.receiver.adc"]), ("image", [])):
        assert options.shard_modules({"effects": {"adc": {}}, "shards": {"kind": kind}}) == modules
    assert options.noise_modules({"effects": {"canceller": None}}) == [
        "lowalt.scene.set_noise",
        "lowalt.scene.effects.detection.canceller",
    ]
    assert options.noise_modules({"effects": {"adc": None}}) == []


def scene(effects, **more):
    """Files and settings of the default run with effects, whether or not they fit together."""
    run = run_of()
    run = replace(run, config=merge(run.config, {"effects": effects, **more}))
    return Products(run), Settings(run)


def test_settings_name_an_effect_for_the_stages_that_read_it_alone():
    _, plain = scene({})
    products, cancelled = scene({"canceller": {"kind": "mean"}})
    assert "filters" not in json.loads(plain.noise(CHUNK)) and products.tile_content(CHUNK) == {}
    assert json.loads(cancelled.noise(CHUNK))["filters"] == {"canceller": {"kind": "mean"}}
    assert "canceller" not in json.loads(cancelled.shard(CHUNK))
    assert json.loads(scene({"canceller": None})[1].noise(CHUNK))["filters"] == {"canceller": {}}
    assert json.loads(scene({"companions": None})[1].shard(CHUNK))["companions"] == {}
    assert "companions" not in json.loads(plain.shard(CHUNK))
    _, recipe = scene({"canceller": {"kind": "mean"}}, shards={"kind": "recipe"})
    assert json.loads(recipe.shard(CHUNK))["canceller"]["kind"] == "mean"
    _, no_canceller = scene({}, shards={"kind": "recipe"})
    assert "canceller" not in json.loads(no_canceller.shard(CHUNK))


def test_late_symbols_tell_the_tiles_their_draws_and_other_scenes_do_not():
    late = {"slow_time": {"jitter_s": 1e-4}}
    products, settings = scene(late, spectra={"times": "known"})
    assert products.tile_content(CHUNK) == {"motion": "results/default/motion/seen-00001.csv"}
    drawn = json.loads(settings.images(CHUNK))["drawn"]
    assert set(drawn) == {"seed", "effects"} and list(drawn["effects"]) == ["slow_time"]
    products, settings = scene(late)
    assert products.tile_content(CHUNK) == {} and "drawn" not in json.loads(settings.images(CHUNK))


def test_an_echo_in_a_scene_knows_set_snrs_where_all_cells_hold_noise():
    assert "snr_db" not in json.loads(scene({"adc": {}})[1].echo_in_scene(CHUNK))
    assert "snr_db" in json.loads(scene({"cell_noise": {}})[1].echo_in_scene(CHUNK))


def test_an_echo_s_settings_hold_its_own_station_and_those_of_all_stations_otherwise():
    _, settings = scene({})
    alone = settings.echo(CHUNK)
    all_of_them = settings.echo(SimpleNamespace(run="default", group="seen", part="00001"))
    stations = [list(json.loads(text)["network"]["stations"]) for text in (alone, all_of_them)]
    assert "B" in stations[0] and stations[1] == ["A", "B", "C"] and alone != all_of_them


def test_added_levels_are_the_settings_of_their_own_chunks():
    run, _, settings = parts({"noise": {"snr_db": [3, 8]}, "added": [{"snr_db": [1.5]}]})
    levels = {
        tuple(json.loads(settings.noise(SimpleNamespace(group=group, part=part)))["snr_db"])
        for group, part in (name.split("-", 1) for name in run.plan.chunks)
    }
    assert levels == {(3, 8), (1.5,)}


def test_companions_bring_their_clouds_once():
    run = run_of()
    one = run.plan.groups["seen"][0]
    other = run.plan.groups["unseen"][0]
    products, _ = scene({"companions": {"subtypes": [other, one, other]}})
    own = products.chunk_clouds(CHUNK)
    assert products.scene_clouds(CHUNK) == [*own, f"results/default/clouds/{slug(other)}.npz"]
    products, _ = scene({"companions": None})
    assert products.scene_clouds(CHUNK) == own


def test_trainings_are_those_of_each_scheme_s_protocols_and_seeds(tmp_path):
    table = tmp_path / "table.csv"
    table.write_text(
        "scheme,stations,spectra,fusion,backbone,protocols\nfew,A,VRP,attention,,seen+unseen\n"
        "more,AB,VRP,attention,,seen\nother,ABC,VRP,attention,,unseen\n"
    )
    block = {"table": str(table), "schemes": ["few", "more", "other"], "timed": [], "seeds": [4, 5]}
    run, _, _ = parts({"recognition": block})
    assert run.trainings == [
        f"{name}/{seed}"
        for name in ("seen/few", "unseen/few", "seen/more", "unseen/other")
        for seed in (4, 5)
    ]
