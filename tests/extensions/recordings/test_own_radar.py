"""A recogniser for one's own radar.

Its twin out of a record, a network that predicts, and what is asked for.
"""

import re

import numpy as np
import pytest
import torch
import yaml
from scipy.io import wavfile

from lowalt.__main__ import main as lowalt
from lowalt.extensions.recordings.files import Baseband, read
from lowalt.extensions.recordings.own_radar import calibrated, snr_range, temperature, trained_radar
from lowalt.extensions.recordings.record import read_record, record
from lowalt.extensions.recordings.twin import twin_of
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.extensions.recordings.twin_training import settings, simulated, train
from lowalt.extensions.recordings.window_samples import Windows, facts
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.machine.progress import Reporter

SAID = {"waveform": "cw", "distance_m": [2, 10], "height_m": [-1, 1], "beam_deg": 60}


def stated(folder, channel="real", carrier=10.525e9, **twin):
    block = {
        "file": "walk.wav",
        "carrier_hz": carrier,
        "channel": channel,
        "rate_hz": 12000,
        "twin": {**SAID, **twin},
    }
    return record(block, folder, "walk.yaml")


@pytest.mark.parametrize(
    "channel, rate, sampling, edge",
    [
        ("complex", 12000, "anti_aliased", 20.0),
        ("real", 12000, "one_sided", 10.0),
        ("complex", 2000, "bare", 14.24),
    ],
)
def test_the_twin_keeps_the_speeds_that_the_radar_can_tell_apart(
    tmp_path, channel, rate, sampling, edge
):
    twin = twin_of(stated(tmp_path, channel), rate)
    assert twin.sampling == sampling and twin.channel == channel
    assert twin.edge_mps == pytest.approx(edge, rel=0.03)
    # A whole number of samples a symbol, where that is near; windows of 0.4 s, and the 400 symbols
    # that spectra need.
    assert twin.symbols == max(400, round(0.4 / twin.symbol_interval_s))
    assert twin.rate_hz * twin.symbol_interval_s >= 1 - 1e-9


def test_what_is_missing_is_asked_for_in_one_sentence(tmp_path):
    block = {
        "file": "walk.wav",
        "carrier_hz": 1e10,
        "channel": "real",
        "twin": {"waveform": "cw", "beam_deg": 60},
    }
    with pytest.raises(
        InputError, match="says nothing of distance_m, height_m, expected a block twin such as"
    ):
        twin_of(record(block, tmp_path, "here"), 12000)
    with pytest.raises(InputError, match=re.escape("here: twin.waveform: value 'pulse'")):
        record({**block, "twin": {"waveform": "pulse"}}, tmp_path, "here")


def test_scenes_stand_at_the_distances_and_heights_of_the_record(tmp_path):
    about = stated(tmp_path, classes=["UAV", "Vehicle", "Pedestrian"], height_m=[3, 4])
    library = Library.of({"mine": (about, twin_of(about, 12000), [0.0, 20.0])})
    assert list(library.scenes["mine"]) == ["UAV", "Vehicle", "Pedestrian"]
    scenes = [scene for scenes in library.scenes["mine"].values() for scene in scenes]
    assert all(scene["height_m"] == [3, 4] and scene["beam"]["width_deg"] == 60 for scene in scenes)
    assert all(scene["receiver"]["snr_db"] == [0.0, 20.0] for scene in scenes)
    (walk,) = (scene for scene in scenes if scene["course"] == "to_and_fro")
    assert all(scene["distance_m"] == [2, 10] for scene in scenes if scene["course"] == "hover")
    # Vehicles pass within a third of the farthest distance and come from that distance.
    passing = [scene for scene in scenes if scene["course"] == "pass"]
    assert passing and all(scene["lateral_m"] == [2, 10 / 3] for scene in passing)
    assert all(scene["ahead_m"] == [-2.5, 10] for scene in passing)
    assert (
        walk["near_m"][0] == 2
        and walk["far_m"][1] == 10
        and walk["far_m"][0] - walk["near_m"][1] >= 2.49
    )


def test_a_record_says_targets_scenes_and_receiver_of_its_own(tmp_path, monkeypatch):
    line = [
        "target",
        "drone",
        "--rotors",
        "6",
        "--diagonal",
        "1.13",
        "--propeller",
        "0.53",
        "--blades",
        "2",
        "--rate",
        "50:60",
        "--speed",
        "18",
        "--subtype",
        "Mine",
        "--out",
        str(tmp_path / "mine.yaml"),
    ]
    assert lowalt(line) == 0
    hover = {
        "subtypes": ["Mine"],
        "course": "hover",
        "distance_m": 3,
        "height_m": 0,
        "sway_m": 0,
        "sway_hz": 1,
        "rock_deg": 0,
    }
    about = stated(
        tmp_path,
        targets=["mine.yaml"],
        classes=["UAV", "Bird"],
        subtypes={"Bird": ["Crow"]},
        scenes={"UAV": [hover], "Bird": "usual"},
        receiver={"highpass_hz": 5, "hum_db": -90},
        slowest_mps=0,
        simulated_hz=6000,
        symbol_interval_s=1e-3,
        symbols=256,
    )
    twin = twin_of(about, 12000)
    assert (twin.slowest_mps, twin.rate_hz, twin.symbol_interval_s, twin.symbols) == (
        0,
        6000,
        1e-3,
        256,
    )
    library = Library.of({"mine": (about, twin, [5.0, 6.0])})
    (mine,), (bird,) = library.scenes["mine"].values()
    assert (
        {**mine, "receiver": 0} == {**hover, "receiver": 0}
        and bird["subtypes"] == ["Crow"]
        and "beam" not in bird
    )
    assert (mine["receiver"]["highpass_hz"], mine["receiver"]["hum_db"]) == (5, -90)
    # Values are drawn in one order, whatever the order in the record is.
    assert next(iter(mine["receiver"])) == "snr_db" and list(mine["receiver"])[-1] == "highpass_hz"
    steps = []
    monkeypatch.setattr(Reporter, "__call__", lambda self, done: steps.append((done, self._unit)))
    windows, names = library.simulated("mine", "UAV", 2, "test")
    assert steps and {unit for _, unit in steps} == {"scenes"}, (
        "the simulation of a radar takes minutes"
    )
    assert windows.shape == (2, 1, 256) and names == ["Mine", "Mine"]


def test_a_radar_without_a_recording_says_its_rate_and_snr(tmp_path):
    block = {"carrier_hz": 24e9, "channel": "real", "rate_hz": 6000, "twin": SAID}
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump(block))
    about = read_record(tmp_path / "mine.yaml")
    with pytest.raises(
        InputError,
        match=r"mine\.yaml: no recording to measure the noise in, expected `file`, or twin",
    ):
        trained_radar(about, tmp_path / "mine", {"seeds": [0]})
    with pytest.raises(
        InputError,
        match=r"mine\.yaml: the record of a radar without any recording, expected the key",
    ):
        read(about)
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump({**block, "twin": None}))
    with pytest.raises(
        InputError, match=r"missing key\(s\) \['file'\], expected it, or twin and rate_hz"
    ):
        read_record(tmp_path / "mine.yaml")


def test_the_snr_of_the_recording_is_measured(tmp_path):
    about = stated(tmp_path, "complex")
    rng = np.random.default_rng(0)
    times = np.arange(120_000) / 12000
    twin = twin_of(about, 12000)
    levels = []
    for snr in (5, 15):
        noise = rng.standard_normal((2, len(times))) * np.sqrt(0.5 * 12000 * twin.symbol_interval_s)
        # The target changes its speed, so that the quiet windows of every speed show the noise, and
        # a little of it.
        speed = 5 + 4 * np.sin(2 * np.pi * 0.3 * times)
        phase = 4 * np.pi / 0.02848 * np.cumsum(speed) / 12000
        values = 10 ** (snr / 20) * np.exp(1j * phase) + noise[0] + 1j * noise[1]
        low, high = snr_range(about, twin, Baseband(values, 12000.0))
        levels.append((low + high) / 2)
        assert high - low == pytest.approx(10, abs=2)
    np.testing.assert_allclose(levels, [5, 15], atol=2)


def test_the_temperature_makes_probabilities_true():
    rng = np.random.default_rng(0)
    truth = rng.dirichlet([1, 1, 1], 20_000)
    labels = np.array([rng.choice(3, p=one) for one in truth])
    sharp = truth**2.5 / (truth**2.5).sum(axis=1, keepdims=True)
    assert temperature(sharp, labels) == pytest.approx(2.5, rel=0.05)


def test_settings_hold_no_folder_of_this_machine_in_any_folder(tmp_path, monkeypatch):
    """They become part of every model file."""
    at_home = settings()
    monkeypatch.chdir(tmp_path)
    assert settings() == at_home and at_home["table"] == "config/schemes.csv"


def test_no_two_folds_classes_or_scenes_share_a_draw_and_what_was_drawn_is_found_again(tmp_path):
    hover = {"subtypes": ["Crow"], "course": "hover", "distance_m": [2, 10], "height_m": 0}
    hover |= {"sway_m": 0, "sway_hz": 1, "rock_deg": 0}
    about = stated(tmp_path, classes=["Bird", "UAV"], scenes={"Bird": [hover] * 2, "UAV": [hover]})
    library = Library.of({"mine": (about, twin_of(about, 12000), [20.0, 30.0])})
    block = settings(over={"echoes": {"train": 2, "validation": 2}, "receivers": 2})
    drawn = []
    for fold in [*block["echoes"]] * 2:
        drawn.append(simulated(library, "mine", block, fold, ("Bird", "UAV"), tmp_path).images)
    np.testing.assert_array_equal(drawn[:2], drawn[2:])
    assert len(np.unique(np.concatenate(drawn[:2]), axis=0)) == 2 * 2 * 2 * 2


def test_a_network_is_trained_in_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    block = settings(over={"size": 24, "training": {"steps": 1, "batch": 4, "validate_every": 1}})
    images = np.random.default_rng(0).integers(0, 255, (8, 3, 24, 24), np.uint8)
    about = facts(np.arange(8) % 4, ["a target"] * 8, np.arange(8), np.zeros(8), "train")
    windows = dict.fromkeys(("train", "validation"), Windows(images, about))
    network = train(block, windows, "mine", 0, tmp_path / "mine")
    assert not network.training and (tmp_path / "mine/model.safetensors").is_file()


# Two minutes on a busy machine.
@pytest.mark.slow
def test_a_record_becomes_a_network_that_predicts_in_any_folder(tmp_path, capsys, monkeypatch):
    block = load_yaml("config/measured/recognition.yaml") | {"size": 24, "receivers": 1}
    block |= {"echoes": {"train": 2, "validation": 2}}
    block["training"] |= {"steps": 2, "batch": 4, "validate_every": 1}
    (tmp_path / "recognition.yaml").write_text(yaml.safe_dump(block))
    times = np.arange(24_000) / 12000
    values = np.cos(4 * np.pi * 1.2 * times / 0.02848) + np.random.default_rng(0).normal(
        0, 0.1, 24_000
    )
    wavfile.write(tmp_path / "walk.wav", 12000, (8000 * values).astype(np.int16))
    about = {
        "file": "walk.wav",
        "carrier_hz": 10.525e9,
        "channel": "real",
        "twin": {**SAID, "classes": ["Pedestrian", "Vehicle"], "caution": "few were tested"},
    }
    (tmp_path / "walk.yaml").write_text(yaml.safe_dump(about))
    monkeypatch.chdir(tmp_path)
    line = [
        "recording",
        "train",
        str(tmp_path / "walk.yaml"),
        "--out",
        str(tmp_path / "mine"),
        "--recognition",
        str(tmp_path / "recognition.yaml"),
    ]
    assert lowalt(line) == 0
    assert "of 4 simulated windows right (Pedestrian " in capsys.readouterr().out
    assert {path.name for path in tmp_path.glob("mine*")} == {"mine.safetensors", "mine.md"}
    assert lowalt(["predict", str(tmp_path / "mine"), str(tmp_path / "walk.yaml")]) == 0
    said = capsys.readouterr().out
    assert (
        re.search(r"windows hold a target: Pedestrian \d, Vehicle \d", said)
        and "note: few were tested\n" in said
    )
    card = (tmp_path / "mine.md").read_text()
    assert "- Few were tested.\n" in card and re.search(
        r"It classifies [\d.]+ % of 4 simulated windows", card
    )


def test_a_calibrated_network_divides_its_logits_by_the_temperature():
    torch.manual_seed(1)
    network = torch.nn.Module()
    network.classifier = torch.nn.Sequential(
        torch.nn.Linear(5, 4), torch.nn.ReLU(), torch.nn.Linear(4, 3)
    )
    samples = torch.randn(6, 5)
    logits = network.classifier(samples)
    network.load_state_dict(calibrated(network.state_dict(), 2.5))
    torch.testing.assert_close(network.classifier(samples), logits / 2.5)
