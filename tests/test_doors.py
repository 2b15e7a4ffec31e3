"""What strangers bring through each door: no code is run, nothing outside is opened, no network is
asked, and one sentence in plain characters says why.
"""

import functools
import json
import os
import pickle
import runpy
import socket
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch
import yaml

import lowalt
from dataset import build
from lowalt.__main__ import main
from lowalt.config.layers import overlaid
from lowalt.files.errors import InputError, in_plain_characters
from lowalt.files.shipped import SHIPPED
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition import train_evaluate
from lowalt.recognition.dataset_samples import opened
from lowalt.recognition.recogniser import backbone
from lowalt.shards import ShardSet, index
from lowalt.shards.build import main as build_shards
from lowalt.shards.remake import Remaker
from lowalt.targets.records import load_table, with_row
from lowalt.workflow.refusals import refuse_input
from tables import rows

EFFECT = """
from pathlib import Path
Path("ran").touch()
SOURCE = "nowhere"
DEFAULTS = {}
def receive(settings, samples, look, rng):
    return samples
"""
BACKBONE = "from pathlib import Path\nPath('ran').touch()\ndef run(size):\n    return None\n"

_opened: list[str] = []
_asked: list[str] = []


def _hook(event: str, given: tuple) -> None:
    """Note what is opened and whom the network is asked for."""
    if event == "open" and isinstance(given[0], (str, bytes, os.PathLike)):
        _opened.append(os.fsdecode(given[0]))
    if event in ("socket.connect", "socket.getaddrinfo"):
        _asked.append(str(given))


sys.addaudithook(_hook)


class Runs:
    """Leaves a file when it is unpickled."""

    def __reduce__(self):
        return os.mkdir, ("ran",)


@pytest.fixture
def doors(tmp_path, monkeypatch):
    """A working directory with a stranger's folder `theirs`, and files of the user elsewhere."""
    here = tmp_path / "here"
    secret = tmp_path / "secret"
    (here / "theirs/shards").mkdir(parents=True)
    secret.mkdir()
    monkeypatch.chdir(here)
    for folder in (secret, here, here / "theirs"):
        # An effect is run once for each of its contents, so each test has its own.
        (folder / "evil.py").write_text(f"{EFFECT}# {folder}\n")
        (folder / "net.py").write_text(BACKBONE)
        with (folder / "weights.pt").open("wb") as file:
            pickle.dump(Runs(), file)
    for name in ("targets.csv", "schemes.csv", "targets/bird.yaml"):
        (secret / Path(name).name).write_bytes((SHIPPED / "config" / name).read_bytes())
    (secret / "track.csv").write_text("time_s,x_m,y_m,z_m\n0,200,100,50\n9,210,100,50\n")
    (secret / "town.geojson").write_text('{"type": "FeatureCollection", "features": []}')
    for name in ("targets.csv", "bird.yaml", "schemes.csv"):
        (here / "theirs" / name).symlink_to(secret / name)
    (here / "theirs/folder").symlink_to(secret)
    header = "scheme,stations,spectra,fusion,backbone,protocols\n"
    (here / "theirs/coded.csv").write_text(f"{header}A:VT,A,VT,attention,theirs/net.py:run,seen\n")
    (here / "theirs/shards/index.json").write_text("{}")
    np.save(here / "signals.npy", np.ones((3, 400), np.complex64))
    _opened.clear()
    _asked.clear()
    return here


def held(act, capsys=None) -> str:
    """The sentence with which a call refuses; nothing ran, and no file of `secret` was opened."""
    _opened.clear()
    _asked.clear()
    try:
        status = act()
    except InputError as error:
        told = str(error)
    except SystemExit as ended:
        assert ended.code == 2
        told = capsys.readouterr().err
    else:
        assert status == 2, f"accepted: {status}"
        told = capsys.readouterr().err
    assert not Path("ran").exists()
    assert not [name for name in _opened if f"{os.sep}secret{os.sep}" in os.path.realpath(name)]
    assert not _asked
    assert told and "\n" not in told.strip() and len(told) <= 450
    assert in_plain_characters(told) == told
    return told


def with_key(config: dict, key: str, value: object) -> dict:
    """The configuration with a value at a dotted key."""
    first, _, rest = key.partition(".")
    if not rest:
        return config | {first: value}
    return config | {first: with_key(config.get(first, {}), rest, value)}


ATTACKS = load_yaml(Path(__file__).parent / "data/tables/attacks.yaml")
"""Keys of a configuration and what a stranger would have them hold, by name and kind of attack."""
CODE = ATTACKS["code"]
PLACES = ATTACKS["places"]
INPUTS = ATTACKS["inputs"]
TRAINING = ATTACKS["training"]


@functools.cache
def tiny() -> dict:
    """A whole configuration, which nobody changes."""
    return overlaid(["config/tiny.yaml"])


def attacked(doors: Path, attack: tuple[str, object]) -> dict:
    """A whole configuration with an attack in it, as a run's folder holds it."""
    key, value = attack
    value = json.loads(json.dumps(value).replace("{secret}", str(doors.parent / "secret")))
    whole = with_key(tiny(), key, value)
    if key == "motion.track":
        whole = with_key(whole, "motion.looks", 2)
    return whole


def brought(doors: Path, attack: tuple[str, object]) -> str:
    """The path of the configuration of a stranger's run with an attack in it."""
    path = doors / "theirs/config.yaml"
    path.write_text(yaml.safe_dump(attacked(doors, attack)))
    return "theirs/config.yaml"


ENTRIES = {
    "Dataset": lowalt.Dataset,
    "receive": lambda path: lowalt.receive(path, "Crow"),
    "receive over an overlay": lambda path: lowalt.receive(["config/tiny.yaml", path], "Crow"),
    "sample": lambda path: main(["sample", "Crow", "0", "--overlay", path]),
    "sample --raw": lambda path: main(["sample", "Crow", "0", "--raw", "--overlay", path]),
    "explain": lambda path: main(["explain", path]),
    "explain with an overlay": lambda path: main(["explain", "config/tiny.yaml", path]),
    "spectra": lambda path: main(["spectra", path]),
    "run": lambda path: main(["run", path, "-n"]),
    "run --configfile": lambda path: main(["run", "--configfile", path, "-n"]),
    "predict": lambda path: main(
        ["predict", "default-seen", f"{Path.cwd()}/signals.npy", "--overlay", path]
    ),
    "shards.build": lambda path: build_shards(["--config", path, "--out", "made"]),
    "trainings on samples made on the spot": opened,
}


@pytest.fixture
def zoo(doors):
    """The small models of the checkout."""
    (doors / "results").mkdir()
    (doors / "results/zoo").symlink_to(SHIPPED / "results/zoo")


ALIKE = ("an effect beside the run", "the table of targets by a link", "a flight log")
"""Attacks that are tried at every entry: one names code, one a file that is read first, and one a
file that is read late."""
PAIRS = {(entry, attack) for entry in ENTRIES for attack in ALIKE} | {
    ("Dataset", attack) for attack in CODE | PLACES
}


@pytest.mark.parametrize(("entry", "attack"), sorted(PAIRS))
def test_a_run_s_configuration_names_no_code_and_no_file_outside(doors, zoo, entry, attack, capsys):
    path = brought(doors, (CODE | PLACES)[attack])
    told = held(lambda: ENTRIES[entry](path), capsys)
    assert "which a file may not choose; expected an overlay of your own" in told
    assert "theirs/config.yaml: " in told


@pytest.mark.parametrize("attack", INPUTS)
@pytest.mark.parametrize("entry", ["receive", "sample", "explain", "run"])
def test_a_run_s_configuration_names_no_folder_of_inputs_outside(doors, entry, attack, capsys):
    path = brought(doors, INPUTS[attack])
    assert "inputs is" in held(lambda: ENTRIES[entry](path), capsys)


@pytest.mark.parametrize(("path", "beside", "whole", "linked"), rows("attacks", "disguises"))
@pytest.mark.parametrize("entry", ["receive", "sample", "explain", "spectra", "run"])
def test_a_run_s_configuration_is_known_in_every_disguise(
    doors, entry, path, beside, whole, linked, capsys
):
    """A whole configuration counts as that of a run, and so does an overlay that lies beside the
    files of a run. Neither the name of the file nor a link to it changes that.
    """
    config = attacked(doors, CODE["an effect beside the run"])
    held_path = doors / (linked or path)
    held_path.parent.mkdir(exist_ok=True)
    held_path.write_text(yaml.safe_dump(config if whole else {"effects": config["effects"]}))
    if linked:
        (doors / path).symlink_to(held_path)
    if beside:
        (doors / beside).touch()
    assert "its effect 'theirs/evil.py' is code" in held(lambda: ENTRIES[entry](path), capsys)


def test_an_overlay_of_the_user_may_name_code_and_files_anywhere(doors):
    secret = doors.parent / "secret"
    block = {
        "effects": {f"{secret}/evil.py": {}},
        "targets": {"table": f"{secret}/targets.csv"},
        "inputs": str(secret),
    }
    (doors / "mine.yaml").write_text(yaml.safe_dump(block))
    lowalt.receive("mine.yaml", "Crow")
    assert Path("ran").exists()


def test_a_run_of_the_user_with_files_of_this_folder_and_the_package_is_read(doors):
    (doors / "mine.csv").write_bytes((SHIPPED / "config/targets.csv").read_bytes())
    (doors / "more.yaml").write_text("{}")
    for attack in (("targets.table", "mine.csv"), ("targets.own", {"mine": "./more.yaml"})):
        path = brought(doors, attack)
        assert len(lowalt.Dataset(path))
        assert len(lowalt.receive(path, "Crow").times_s)


def reported(path: str) -> int:
    """Ask for the page of a stranger's run, which stands where runs of the user do."""
    Path("results/tiny").mkdir(parents=True)
    Path("results/tiny/config.yaml").write_bytes(Path(path).read_bytes())
    return main(["report", "results/tiny", "-n"])


TRAINERS = {
    "train": lambda path: lowalt.train(Path(path).parent, "A:VT", "seen"),
    "run": ENTRIES["run"],
    "report": reported,
}


@pytest.mark.parametrize("attack", TRAINING)
@pytest.mark.parametrize("trainer", TRAINERS)
def test_a_run_s_configuration_names_no_weights_no_backbone_and_no_table_outside(
    doors, trainer, attack, capsys
):
    path = brought(doors, TRAINING[attack])
    assert "may not choose" in held(lambda: TRAINERS[trainer](path), capsys)


def test_the_caller_may_name_the_weights_of_a_run(doors, monkeypatch):
    brought(doors, TRAINING["weights of a hub"])
    begun = []
    source = SimpleNamespace(for_training=lambda *_: {})
    monkeypatch.setattr(
        train_evaluate, "ShardSet", lambda _: SimpleNamespace(classes=("UAV", "Bird"))
    )
    monkeypatch.setattr(train_evaluate.Source, "of_run", lambda *_: source)
    monkeypatch.setattr(train_evaluate.runs, "load", lambda *_: None)
    monkeypatch.setattr(
        train_evaluate.runs, "train", lambda *given: begun.append(given[3]["network"]["weights"])
    )
    for weights in ("none", "hub", "mine.safetensors"):
        lowalt.train("theirs", "A:VT", "seen", weights=weights)
    assert begun == ["none", "hub", "mine.safetensors"]


def test_a_run_whose_jobs_would_refuse_its_own_configuration_does_not_begin(doors):
    """Jobs that make samples on the spot read config.yaml of the run."""
    config = attacked(doors, PLACES["own targets"])
    config = with_key(with_key(config, "recognition.input", "dataset"), "recognition.cache", False)
    with pytest.raises(InputError, match=r"recognition.input: 'dataset': targets.own.mine is "):
        refuse_input(config)
    refuse_input(with_key(config, "targets.own", {}))


def test_the_backbone_of_a_run_s_configuration_is_not_trusted_for_a_model(doors, zoo, capsys):
    path = brought(doors, TRAINING["a backbone"])
    told = held(lambda: ENTRIES["predict"](path), capsys)
    assert "its backbone 'theirs/net.py:run' is code" in told


def test_weights_of_the_user_s_own_run_no_pickle(doors):
    told = held(lambda: backbone("test_resnet", "weights.pt", 32))
    assert "with weights 'weights.pt'" in told


@pytest.mark.parametrize("name", ["hf-hub:timm/test_resnet", "hf_hub:a/b", "local-dir:theirs"])
def test_a_backbone_s_name_asks_no_hub(doors, name):
    assert "is not a timm model" in held(lambda: backbone(name, "none", 32))


def test_an_index_whose_images_need_the_instants_of_an_effect_runs_no_effect(doors, tmp_path):
    folder = build(tmp_path / "brought", "signal", inputs=False)
    content = json.loads((folder / "index.json").read_text())
    content["render"]["spectra"]["times"] = "known"
    content["echo"] = {"tolerance": None, "effects": {f"{doors}/evil.py": {}}}
    content["sha256"] = index._checksum(content)
    (folder / "index.json").write_text(json.dumps(content))
    shards = ShardSet(folder / "index.json")
    for ask in (shards.tile, shards.late, shards.images, lambda _: Remaker(shards, {})):
        assert "is code, which a file may not choose" in held(lambda ask=ask: ask(0))


NAMES = (
    "<script>alert(1)</script>",
    "=cmd|' /C calc'!A0",
    "@SUM(1+1)",
    "-2+3",
    "+1",
    "a\x1b[31mred",
    "a\u202egnp.exe",
    "a\nb",
    "a|b",
    'a"b',
    "a`id`",
    "a$(id)",
    "{a}",
    "",
    " ",
    "a" * 81,
)


@pytest.mark.parametrize("name", NAMES)
def test_names_of_subtypes_hold_no_markup_and_no_formula(name, tmp_path):
    cells = {"category": "Bus", "len_m": 9, "wid_m": 2, "hgt_m": 3}
    with pytest.raises(InputError, match="the subtype's name is ") as refused:
        with_row(None, name, cells, "own.yaml")
    assert "\x1b" not in str(refused.value) and "\u202e" not in str(refused.value)
    quoted = '"' + name.replace('"', '""') + '"'
    lines = (SHIPPED / "config/targets.csv").read_text().splitlines()
    lines[11] = lines[11].replace("Crow", quoted)
    (tmp_path / "t.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=r"t\.csv: the subtype's name is "):
        load_table(tmp_path / "t.csv")


@pytest.mark.parametrize("name", ["Crow", "Ramphastidae (toucan)", "Su-27/30", "Köln 1", "2 & 3"])
def test_usual_names_of_subtypes_are_names(name):
    assert with_row(None, name, {"category": "Bus"}, "own.yaml")["name"] == name


def test_control_characters_of_a_run_do_not_reach_the_terminal(tmp_path, capsys):
    for name, colour in (("one", 31), ("two", 32)):
        (tmp_path / name).mkdir()
        block = {"run": "x", "note\x1b[31m": f"\x1b[{colour}m\x1b]0;owned\x07\x9b\u202e"}
        (tmp_path / name / "config.yaml").write_text(yaml.safe_dump(block))
    assert main(["compare", str(tmp_path / "one"), str(tmp_path / "two")]) == 0
    told = capsys.readouterr().out
    assert "note\\x1b[31m" in told and in_plain_characters(told) == told


def test_a_file_s_name_of_control_characters_does_not_reach_the_terminal(tmp_path, capsys):
    assert main(["verify", str(tmp_path / "a\x1b[2Jb.json")]) == 2
    told = capsys.readouterr().err
    assert "a\\x1b[2Jb.json" in told and in_plain_characters(told) == told


def test_the_attacks_see_what_runs_and_what_is_opened(doors, capsys):
    """The hook and the files would notice an attack that succeeds."""
    runpy.run_path("evil.py")
    assert Path("ran").exists()
    Path("ran").unlink()
    (doors.parent / "secret/targets.csv").read_text()
    assert [name for name in _opened if "secret" in name]
    with pytest.raises(OSError), socket.create_connection(("127.0.0.1", 9), 1):
        pass
    assert _asked
    with pytest.raises(AssertionError):
        held(lambda: (doors.parent / "secret/targets.csv").read_text() and 2, capsys)
    with pytest.raises(RuntimeError):
        torch.load("weights.pt", weights_only=False)
    assert Path("ran").exists()
