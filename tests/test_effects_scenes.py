"""Scenes: the shipped ones fit together, contradictory ones are refused by name, explain says what is done, and a scene
whose effects have no strength leaves every byte as it was."""

from pathlib import Path

import numpy as np
import pytest

from lowalt.__main__ import main
from lowalt.common.config import canonical, load
from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.echo.__main__ import main as echo_command
from lowalt.effects.__main__ import main as effects_command
from lowalt.effects.catalogue import PLACES
from lowalt.effects.checks import check
from lowalt.motion.sample import draw, region_polygon
from lowalt.motion.table import write_table
from lowalt.noise.__main__ import main as noise_command
from lowalt.targets.cloud import write
from lowalt.targets.make import make
from lowalt.targets.records import load_records

ROOT = Path(__file__).parent.parent
BASE, SCHEMA = ROOT / "config/default.yaml", ROOT / "workflow/schemas/config.schema.yaml"
SCENES = sorted((ROOT / "config/scenes").glob("*.yaml"))


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_a_shipped_scene_fits_together_and_is_a_few_lines(path):
    checked = check(load([BASE, path], SCHEMA))
    assert (path.stem == "paper") == (not checked.effects)
    assert len(path.read_text().splitlines()) < 40


def test_the_shipped_scenes_have_every_effect():
    named = {path.stem: set(check(load([BASE, path], SCHEMA)).effects) for path in SCENES}
    assert set().union(*named.values()) == set(PLACES)
    assert len(named["worst"]) >= 22


@pytest.mark.parametrize(
    "effects, more, words",
    [
        ("{ground_reflection: {}}", "network: {stations: {A: {position_m: [0.0, 0.0, -1.0]}}}", "ground_reflection.*A"),
        ("{ground_reflection: {permittivity: 0.5}}", "", "permittivity"),
        ("{receiver_noise: {}}", "", "link budget or set SNRs"),
        ("{canceller: {}}", "", "no clutter to cancel"),
        ("{adc: {bits: 12.5}}", "", "effects.adc.bits: value 12.5"),
        ("{rain: {}}", "", "unknown key.*rain"),
        ("{clock_offset: {sigma_ppm: 5}}", "", "clock_offset.*prefix"),
    ],
)
def test_a_contradictory_scene_is_refused_by_name(tmp_path, effects, more, words):
    scene = tmp_path / "scene.yaml"
    scene.write_text(f"run: broken\neffects: {effects}\n{more}\n")
    with pytest.raises(InputError, match=words):
        check(load([BASE, scene], SCHEMA))


def test_explain_says_what_is_done_and_what_is_not(tmp_path, capsys):
    scene = tmp_path / "scene.yaml"
    scene.write_text("run: mine\necho: {tolerance: 0.3}\neffects: {squint: {}, rotor_spread: {}, adc: {bits: 0}}\n")
    where = ["--base", str(BASE), "--schema", str(SCHEMA), "--sample", "Walking Pedestrian 1:2"]
    assert main(["explain", str(scene), *where]) == 0
    text = capsys.readouterr().out
    assert "scene mine" in text and "tolerance 0.3" in text
    assert "named, but the identity with these parameters, so left out: adc" in text
    assert "not imported and nothing drawn: gusts" in text
    assert "Walking Pedestrian 1, model 2, station A" in text
    assert "squint: " in text and "of the largest value" in text
    assert "base" in text and "| +" in text
    assert main(["explain", str(scene), *where, "--station", "Z"]) == 2
    assert "station 'Z'" in capsys.readouterr().err


def chunk(folder, subtypes):
    """A chunk's clouds and motion table of one model of each subtype; returns (config, table, cloud files)."""
    config = load([BASE], SCHEMA)
    records = load_records(ROOT / config["targets"]["table"], [ROOT / path for path in config["targets"]["records"]])
    masts = np.array([place["position_m"][:2] for place in config["network"]["stations"].values()])
    corners = region_polygon(masts, None)
    rows, files = [], []
    for name in subtypes:
        cloud = make(records[name], None, 1)
        files.append(folder / f"{name}.npz")
        write(files[-1], cloud)
        row = draw(stream(1, "motion", name, 0), cloud, records[name]["published"], masts, corners, config["motion"])
        rows.append({**row, "group": "seen", "model": 0})
    write_table(folder / "motion.csv", rows)
    return config, folder / "motion.csv", files


def test_effects_without_strength_leave_every_byte(tmp_path):
    config, table, clouds = chunk(tmp_path, ["DJI Mini 2", "Walking Pedestrian 1"])
    block = {"network": config["network"], "tolerance": None}
    common = ["--motion", str(table), "--clouds", *map(str, clouds), "--station", "A"]
    echo_command(["--settings", canonical(block), *common, "--out", str(tmp_path / "plain.npy")])
    idle = {"rotor_spread": {"spread": 0, "wander": 0}, "adc": {"bits": 0}, "cell_error": {"probability": 0},
            "ground_reflection": {"permittivity": 1, "conductivity_s_m": 0}, "gusts": {"wind_mps": 0}}  # fmt: skip
    out = ["--out", str(tmp_path / "idle.npy"), "--power", str(tmp_path / "power.npy")]
    effects_command(["--settings", canonical({**block, "seed": 5, "effects": idle}), *common, *out])
    assert (tmp_path / "plain.npy").read_bytes() == (tmp_path / "idle.npy").read_bytes()
    noise = ["--settings", canonical({"seed": 5, "stations": ["A"], "snr_db": [3, 13]}), "--motion", str(table)]
    for name, more in (("plain", []), ("idle", ["--powers", str(tmp_path / "power.npy")])):
        noise_command(
            [*noise, "--echoes", str(tmp_path / f"{name}.npy"), *more, "--out", str(tmp_path / f"{name}-n.npy")]
        )
    assert (tmp_path / "plain-n.npy").read_bytes() == (tmp_path / "idle-n.npy").read_bytes()


def test_set_snrs_refer_to_the_target_alone(tmp_path):
    config, table, clouds = chunk(tmp_path, ["DJI Mini 2"])
    common = ["--motion", str(table), "--clouds", *map(str, clouds), "--station", "A"]
    settings = {"network": config["network"], "tolerance": None, "seed": 5,
                "effects": {"clutter": {"clutter_to_signal_db": 30.0}}}  # fmt: skip
    paths = ["--out", str(tmp_path / "loud.npy"), "--power", str(tmp_path / "power.npy")]
    effects_command(["--settings", canonical(settings), *common, *paths])
    loud, power = np.load(tmp_path / "loud.npy")[0], float(np.load(tmp_path / "power.npy")[0])
    assert np.mean(abs(loud) ** 2) > 10 * power
    noise = ["--settings", canonical({"seed": 5, "stations": ["A"], "snr_db": [3]}), "--motion", str(table)]
    paths = ["--echoes", str(tmp_path / "loud.npy"), "--powers", str(tmp_path / "power.npy")]
    noise_command([*noise, *paths, "--out", str(tmp_path / "noisy.npy")])
    added = np.load(tmp_path / "noisy.npy")[0, 0, 0] - loud
    assert np.mean(abs(added) ** 2) == pytest.approx(power / 10**0.3, rel=0.2)
