"""A recording nobody has seen.

A WAV and five lines become spectra, tiles, a shard and a prediction.
"""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml
from PIL import Image
from scipy.io import wavfile

from lowalt.__main__ import main as lowalt
from lowalt.extensions.recordings import read_record
from lowalt.extensions.recordings.__main__ import main
from lowalt.extensions.recordings.twin import radars
from lowalt.extensions.recordings.windows import spectra, write
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.shards import ShardSet, faults

SECONDS = 1.3
CARRIER = 24.0e9
SPEED = 6.0


def drive(folder, rate, stereo, swapped=False, **more):
    """Write a WAV of a target, and its record of five lines.

    The target leaves at SPEED from a fifth of a second on.
    """
    time = np.arange(round(SECONDS * rate)) / rate
    tone = np.exp(-2j * np.pi * 2 * SPEED * CARRIER / 299792458.0 * time) * (time > 0.2)
    noise = np.random.default_rng(0).standard_normal((2, len(time)))
    values = 0.2 * tone + 0.01 * (noise[0] + 1j * noise[1])
    pair = np.stack([values.real, values.imag][:: -1 if swapped else 1], axis=1)
    wavfile.write(
        folder / "drive.wav", rate, (20000 * (pair if stereo else pair[:, 0])).astype(np.int16)
    )
    block = {"file": "drive.wav", "carrier_hz": CARRIER, "channel": "complex" if stereo else "real"}
    path = folder / "drive.yaml"
    path.write_text(yaml.safe_dump({**block, "source": "made here", "licence": "MIT", **more}))
    return path


@pytest.mark.parametrize(
    "rate, stereo", [(8000, False), (44100, False), (22050, True), (96000, True)]
)
def test_a_wav_and_five_lines_become_spectra_and_tiles(tmp_path, rate, stereo):
    path = drive(tmp_path, rate, stereo)
    main(["import", "--record", str(path), "--radar", "cw_24ghz", "--out", str(tmp_path / "out")])
    signals = np.load(tmp_path / "out/signals.npy")
    spectra = np.load(tmp_path / "out/spectra.npz")
    assert len(list((tmp_path / "out/tiles").glob("*.png"))) == len(signals) == int(SECONDS / 0.4)
    # The line stands at the speed that was driven, in every window, in one channel as in two.
    power = np.abs(np.fft.fft(signals * np.hanning(signals.shape[1]), axis=1)) ** 2
    line = power.argmax(axis=1) / signals.shape[1] * 3000.0 * 299792458.0 / CARRIER / 2
    np.testing.assert_allclose(line, SPEED, atol=0.03)
    assert set(spectra) == {"vrp", "trp", "vt"} and all(
        np.isfinite(spectra[name]).all() for name in spectra
    )


def test_a_room_that_hums_is_empty_where_the_record_says_when_it_was(tmp_path, capsys):
    time = np.arange(20_000) / 2000
    craft = 0.3 * np.cos(2 * np.pi * 180 * time) * (time > 4)
    values = (
        0.5 * np.cos(2 * np.pi * 50 * time)
        + craft
        + np.random.default_rng(1).normal(0, 0.1, len(time))
    )
    values[:1600] = 0
    wavfile.write(tmp_path / "room.wav", 2000, (10_000 * values).astype(np.int16))
    about = {"file": "room.wav", "carrier_hz": 10.5e9, "channel": "real"}
    path = tmp_path / "room.yaml"
    starts = {}
    for name, more in {"unknown": {}, "known": {"empty_s": [0, 2.5]}}.items():
        path.write_text(yaml.safe_dump(about | more))
        assert lowalt(["predict", "bird_drone_10ghz", str(path), "--json"]) == 0
        starts[name] = [
            window["start_s"] for window in json.loads(capsys.readouterr().out) if window["target"]
        ]
        assert lowalt(["predict", "bird_drone_10ghz", str(path)]) == 0
        said = capsys.readouterr().out
        assert ("note: targets of this network may hover" in said) == (name == "unknown")
        assert (
            "note: this network learned a radar at 10 GHz, and the recording is at 10.5 GHz" in said
        )
        assert "note: birds and drones of one radar alone tested this network" in said
    assert (
        len(starts["unknown"]) == 23
        and min(starts["known"]) == pytest.approx(4.0)
        and len(starts["known"]) == 15
    )
    # The samples of the first two windows are lost.
    for empty_s in ([1, 1.3], [0, 0.8]):
        path.write_text(yaml.safe_dump(about | {"empty_s": empty_s}))
        assert lowalt(["predict", "bird_drone_10ghz", str(path)]) == 2
        said = capsys.readouterr().err
        assert f"empty_s is {empty_s}, expected a stretch that holds at least one of" in said
        assert "the 25 windows of 0.4 s" in said


def test_a_prediction_names_every_window_and_says_which_hold_a_target(tmp_path, capsys):
    path = drive(tmp_path, 44100, True)
    assert lowalt(["predict", "cw_24ghz", str(path), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["start_s"] for row in rows] == pytest.approx([0, 0.4, 0.8])
    for row in rows:
        shares = {name: row[name] for name in ("UAV", "Bird", "Vehicle", "Pedestrian")}
        assert row["target"] and sum(shares.values()) == pytest.approx(1)
        assert row["class"] == max(shares, key=shares.__getitem__)
    assert lowalt(["predict", "cw_24ghz", str(path)]) == 0
    assert "3 of 3 windows hold a target: " in capsys.readouterr().out


def test_clipped_and_lost_stretches_cost_their_own_windows_and_noise_is_nothing_there(
    tmp_path, capsys
):
    path = drive(tmp_path, 44100, False)
    rate, values = wavfile.read(tmp_path / "drive.wav")
    values[20000:30000] = np.clip(4 * values[20000:30000].astype(int), -5500, 5500)
    values[-10000:] = 0
    wavfile.write(tmp_path / "drive.wav", rate, values)
    assert lowalt(["predict", "cw_24ghz", str(path), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [(row["clipped"], row["target"]) for row in rows] == [
        (False, True),
        (True, False),
        (False, False),
    ]
    main(["import", "--record", str(path), "--radar", "cw_24ghz", "--out", str(tmp_path / "out")])
    assert len(np.load(tmp_path / "out/signals.npy")) == 1
    wavfile.write(
        tmp_path / "drive.wav", rate, np.clip(4 * values.astype(int), -5500, 5500).astype(np.int16)
    )
    assert lowalt(["predict", "cw_24ghz", str(path)]) == 2
    assert "drive.wav: clipped, " in capsys.readouterr().err
    noise = np.random.default_rng(0).standard_normal(2 * rate)
    wavfile.write(tmp_path / "drive.wav", rate, (1000 * noise).astype(np.int16))
    assert lowalt(["predict", "cw_24ghz", str(path)]) == 0
    assert (
        capsys.readouterr()
        .out.rstrip()
        .endswith("nothing there: none of 5 windows holds a target that this network could know")
    )


def test_a_window_with_a_speed_that_the_network_cannot_show_says_so(tmp_path, capsys):
    time = np.arange(44100) / 44100
    fast = np.cos(2 * np.pi * 5000.0 * time) + 0.05 * np.cos(2 * np.pi * 960.0 * time)
    fast += 1e-3 * np.random.default_rng(0).standard_normal(len(time))
    path = drive(tmp_path, 44100, False, carrier_hz=24.5e9)
    wavfile.write(tmp_path / "drive.wav", 44100, (16000 * fast).astype(np.int16))
    assert lowalt(["predict", "cw_24ghz", str(path)]) == 0
    said = capsys.readouterr().out
    assert "a line at 30.6 m/s, beyond the 17.3 m/s of this network" in said
    assert "nothing there: none of 2 windows holds a target" in said


@pytest.mark.parametrize(
    "model, file, changes, words",
    [
        (
            "cw_24ghz",
            "drive.yaml",
            {"carrier_hz": 3.4e9},
            "carrier_hz is 3.4e+09, .*expected a network of .*uav_3ghz",
        ),
        (
            "cw_24ghz",
            "drive.yaml",
            {"carrier_hz": 5.8e9},
            "carrier_hz is 5.8e+09, .*the zoo has none",
        ),
        (
            "uav_3ghz",
            "drive.yaml",
            {"carrier_hz": 3.4e9, "channel": "real"},
            "expected in-phase and quadrature",
        ),
        ("cw_24ghz", "signals.npy", {}, "knows recordings, expected the record of one"),
        ("default-seen", "drive.yaml", {}, "knows no recordings, expected a network of a radar"),
    ],
)
def test_what_a_network_does_not_know_is_refused(tmp_path, capsys, model, file, changes, words):
    drive(tmp_path, 22050, changes.get("channel") != "real", **changes)
    np.save(tmp_path / "signals.npy", np.ones((1, 1200), np.complex64))
    assert lowalt(["predict", model, str(tmp_path / file)]) == 2
    assert re.search(words.replace("+", r"\+"), capsys.readouterr().err)


def test_swapped_channels_are_refused_where_the_direction_is_known(tmp_path):
    call = ["import", "--radar", "cw_24ghz", "--out", str(tmp_path / "out"), "--record"]
    main([*call, str(drive(tmp_path, 22050, True, moves="away"))])
    with pytest.raises(InputError, match="channels swapped, the record says the target moves away"):
        main([*call, str(drive(tmp_path, 22050, True, swapped=True, moves="away"))])
    # Where nobody knows the direction, the one channel that this radar has hears the same speed.
    main([*call, str(drive(tmp_path, 22050, True, swapped=True))])


def test_a_recording_becomes_signals_spectra_tiles_and_a_shard_of_its_own(tmp_path):
    rate = 48000
    time = np.arange(rate) / rate
    # 10 m/s away from a radar at 24 GHz, and a little noise.
    sound = 0.3 * np.cos(2 * np.pi * 1601.0 * time) + 1e-3 * np.random.default_rng(
        0
    ).standard_normal(rate)
    # Slower than what this radar calls a target, which is taken out.
    sound += 0.6 * np.cos(2 * np.pi * 20.0 * time)
    wavfile.write(tmp_path / "drive.wav", rate, sound.astype(np.float32))
    (tmp_path / "drive.yaml").write_text(
        "file: drive.wav\ncarrier_hz: 24.0e+9\nchannel: real\nlabel: Vehicle\nsource: made "
        "here\nlicence: MIT\n"
    )
    record = read_record(tmp_path / "drive.yaml")
    twin = radars()["cw_24ghz"]
    images = load_yaml("config/default.yaml")["images"]
    count = write(record, twin, images, tmp_path / "out")
    signals = np.load(tmp_path / "out/signals.npy")
    assert signals.shape == (count, 1200) == (2, 1200) and signals.dtype == np.complex64
    shown = np.load(tmp_path / "out/spectra.npz")
    np.testing.assert_array_equal(shown["vrp"], spectra(signals[:1], twin)["vrp"][0])
    # Above half the symbol rate: 1601 Hz at 3000 symbols/s stands at -1399 Hz.
    row = int(shown["vrp"].mean(axis=1).argmax())
    assert (row - 128) * 3000 / 256 == pytest.approx(-1399, abs=6)
    shards = ShardSet(tmp_path / "out/shards/index.json")
    assert len(shards) == count and set(shards.labels.tolist()) == {2}
    # A data card is for data sets: everything else of the shard is whole.
    assert all("SHA256SUMS" in line for line in faults(shards.index_path))
    tile = np.asarray(Image.open(tmp_path / "out/tiles/000000.png"))
    found = next(number for number in range(count) if shards.record(number)["model"] == 0)
    np.testing.assert_array_equal(shards.tile(found), tile)
    assert tile.shape == (256, 768)
    entry = shards.record(found)
    assert (
        entry["fold"] == "test"
        and entry["geometry"]["A"]["range_m"] is None
        and entry["motion"]["x_m"] is None
    )
    quiet = tmp_path / "noise.yaml"
    quiet.write_text(
        (tmp_path / "drive.yaml").read_text().replace("channel: real", "channel: complex")
    )
    with pytest.raises(InputError, match="expected one complex or two"):
        write(
            read_record(quiet),
            replace(twin, channel="complex", sampling="bare"),
            images,
            tmp_path / "none",
        )
    assert not (tmp_path / "none").exists()
