"""Recordings held against twins: which files count, what the figures read off, what tables and page
say of them.
"""

import hashlib
import re
import runpy
from pathlib import Path

import accuracy
import class_figures
import fetch
import foreign
import h5py
import numpy as np
import pytest
import recorded_sets
import spectral_figures
import yaml
from comparison import DISTANCES, FIGURES, distance_rows
from recorded_sets import SETS, halves, recordings, usable
from scipy.io import wavfile

from lowalt.config.classes import CATEGORIES
from lowalt.extensions.recordings.answers import Answers
from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.files.csv_tables import read_csv, write_csv
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml

HERE = Path(__file__).parent
# Several studies have a program of this name.
study = runpy.run_path(str(HERE / "study.py"))["main"]


@pytest.fixture(scope="module")
def library():
    return Library.read()


def drive(folder, rate, **more):
    """Write a WAV of a target that leaves at 6 m/s from a fifth of a second on, I and Q, and its
    record.
    """
    time = np.arange(round(1.3 * rate)) / rate
    tone = np.exp(-2j * np.pi * 2 * 6.0 * 24e9 / 299792458.0 * time) * (time > 0.2)
    noise = np.random.default_rng(0).standard_normal((2, len(time)))
    values = 0.2 * tone + 0.01 * (noise[0] + 1j * noise[1])
    wavfile.write(
        folder / "drive.wav",
        rate,
        (20000 * np.stack([values.real, values.imag], axis=1)).astype(np.int16),
    )
    block = {
        "file": "drive.wav",
        "carrier_hz": 24e9,
        "channel": "complex",
        "source": "made here",
        "licence": "MIT",
    }
    (folder / "drive.yaml").write_text(yaml.safe_dump(block | more))


def test_the_files_are_whole_and_halves_share_no_recording(library):
    sets = load_yaml(SETS)
    split = halves()
    assert sorted(sets) == sorted(split)
    assert {record["radar"] for records in sets.values() for record in records} == set(
        library.twins
    )
    for block in (block for name, block in split.items() if name != "car_24ghz"):
        assert block["tuning"] and block["test"] and not set(block["tuning"]) & set(block["test"])
    for pair in load_yaml(HERE / "pictures.yaml")["pairs"].values():
        assert pair["file"] in split[pair["set"]]["tuning"]
        Twin.from_settings(pair["radar"])
    addresses = fetch.addresses(load_yaml(fetch.SOURCES))
    named = {
        f"{name}/{file}"
        for name, block in split.items()
        for half in block.values()
        for file in half
    }
    assert named == set(addresses) - {"vehicle_24ghz/LICENSE"}
    further = fetch.addresses(load_yaml(HERE / "further.yaml"))
    assert not set(further) & set(addresses)
    # A file counts by its content, whatever its name is.
    sums = [pinned for _, pinned in (addresses | further).values()]
    assert len(set(sums)) == len(sums) and all(
        len(pinned) == 64 and int(pinned, 16) for pinned in sums
    )
    for address, _ in (addresses | further).values():
        assert re.fullmatch(
            r"https://raw.githubusercontent.com/[\w.-]+/[\w.-]+/[0-9a-f]{40}/[\w./%-]+", address
        )


def test_what_is_fetched_has_the_pinned_bytes_and_a_copy_is_checked_without_network(
    tmp_path, capsys, monkeypatch
):
    here = tmp_path / "owner/name/0a1b/some folder"
    here.mkdir(parents=True)
    (here / "a b.wav").write_bytes(b"sound")
    sums = {
        name: hashlib.sha256(text).hexdigest()
        for name, text in (("a b.wav", b"sound"), ("c.wav", b"other"))
    }
    block = {"repository": "owner/name", "commit": "0a1b", "folder": "some folder", "files": sums}
    (tmp_path / "sources.yaml").write_text(yaml.safe_dump({"set": [block]}))
    monkeypatch.setattr(fetch, "RAW", tmp_path.as_uri())
    arguments = ["--out", str(tmp_path / "out"), "--sources", str(tmp_path / "sources.yaml")]
    with pytest.raises(InputError, match="1 of 2 files could not be fetched"):
        fetch.main(arguments)
    assert (tmp_path / "out/set/a b.wav").read_bytes() == b"sound"
    assert "c.wav" in capsys.readouterr().err
    (here / "c.wav").write_bytes(b"changed")
    with pytest.raises(InputError, match="1 of 2"):
        fetch.main(arguments)
    assert "SHA-256 is" in capsys.readouterr().err
    assert not (tmp_path / "out/set/c.wav").exists()
    with pytest.raises(InputError, match=r"out: lacks 1 of 2 files of sources\.yaml"):
        fetch.main([*arguments, "--check"])
    assert "set/c.wav: missing, see file://" in capsys.readouterr().out
    (tmp_path / "out/set/c.wav").write_bytes(b"changed")
    with pytest.raises(InputError, match="lacks 1"):
        fetch.main([*arguments, "--check"])
    assert f"expected {sums['c.wav']}" in capsys.readouterr().out
    (tmp_path / "out/set/c.wav").write_bytes(b"other")
    fetch.main([*arguments, "--check"])
    assert "all 2 files of sources.yaml are there" in capsys.readouterr().out


def test_files_of_a_set_that_came_later_are_test_files_and_name_their_carrier(tmp_path):
    later = {
        "walker_24ghz": ["PCM2900_Best_Walking_Data.wav", "tomorrow.wav"],
        "uav_3ghz": [
            "DJI_Hovering_on_Rotors_Foil_10000000__Freq_3.400__Sample_2.mat",
            "renamed.mat",
        ],
    }
    for folder, names in later.items():
        (tmp_path / folder).mkdir()
        for name in names:
            (tmp_path / folder / name).write_bytes(b"")
    seen = {recording.name: recording for recording in recordings(tmp_path)}
    assert [name for name, recording in seen.items() if recording.half == "tuning"] == [
        "PCM2900_Best_Walking_Data.wav"
    ]
    assert [seen[name].record.carrier_hz for name in later["uav_3ghz"]] == [3.4e9, 3.3e9]
    with pytest.raises(InputError, match="no recordings of"):
        recordings(tmp_path / "walker_24ghz")


def test_a_record_next_to_a_new_file_goes_before_the_set_s_pattern(tmp_path):
    folder = tmp_path / "vehicle_24ghz"
    folder.mkdir()
    drive(folder, 22050, label="Pedestrian")
    (new,) = recordings(tmp_path)
    assert (new.name, new.half, new.record.label, new.record.channel) == (
        "drive.wav",
        "test",
        "Pedestrian",
        "complex",
    )
    drive(folder, 22050)
    with pytest.raises(InputError, match=r"drive.yaml: no label, expected one of"):
        recordings(tmp_path)


def volts(folder, name, rate, seconds=1.0):
    """Write a CSV of the set at 10 GHz: volts and sample times."""
    folder.mkdir(exist_ok=True)
    time = np.arange(round(rate * seconds)) / rate
    wave = np.sin(2 * np.pi * 60.0 * time) + 0.01 * np.random.default_rng(1).standard_normal(
        len(time)
    )
    rows = np.stack([wave, time], axis=1)
    np.savetxt(folder / name, rows, delimiter=",", header="V,timestamps", comments="", fmt="%.9g")


def test_later_files_of_a_set_may_have_another_rate_and_bad_ones_are_left_out_by_name(
    tmp_path, capsys, library
):
    folder = tmp_path / "bird_drone_10ghz"
    volts(folder, "bird99.csv", 10000)
    volts(folder, "bird98.csv", 20000)
    volts(folder, "DRONE97.CSV", 10000, seconds=1.001)
    volts(folder, "bird96.csv", 8000)
    volts(folder, "bird95.csv", 10000, seconds=0.2)
    volts(folder, "quadcopter.csv", 10000)
    good = usable(recordings(tmp_path), library)
    assert {recording.name: recording.record.label for recording in good} == {
        "bird99.csv": "Bird",
        "bird98.csv": "Bird",
        "DRONE97.CSV": "UAV",
    }
    for recording in good:
        # 60 Hz stand at 60 Hz, whichever of the set's rates the file has.
        power = np.abs(np.fft.fft(recording.windows(recording.twin(library))[0])) ** 2
        assert power.argmax() / len(power) * 1000.0 == pytest.approx(60.0, abs=2.5)
        assert recording.read().rate_hz in (10000.0, 20000.0)
    said = capsys.readouterr().err
    assert "quadcopter.csv: left out" in said
    assert (
        "bird96.csv: wrong rate" in said
        and "bird95.csv: 200 symbols, shorter than one window" in said
    )
    with pytest.raises(InputError, match="none of 1 recordings can be used"):
        usable(
            [recording for recording in recordings(tmp_path) if recording.name == "bird95.csv"],
            library,
        )


def test_a_folder_that_is_no_set_becomes_one_by_a_file(tmp_path, capsys, library):
    (tmp_path / "buses").mkdir()
    drive(tmp_path / "buses", 22050)
    (tmp_path / "buses/drive.yaml").unlink()
    with pytest.raises(InputError, match="no recordings of"):
        recordings(tmp_path)
    assert (
        f"buses: left out, no set of that name and no {recorded_sets.SET_FILE} in it"
        in capsys.readouterr().err
    )
    line = (
        '{file: "*.wav", carrier_hz: 24.0e+9, channel: complex, label: Vehicle, source: made here,'
        " licence: MIT}"
    )
    (tmp_path / "buses/set.yaml").write_text(f"like: vehicle_24ghz\nfiles:\n  - {line}\n")
    (bus,) = recordings(tmp_path)
    assert (bus.set, bus.like, bus.half, bus.name) == (
        "buses",
        "vehicle_24ghz",
        "test",
        "drive.wav",
    )
    assert bus.twin(library) == library.twins["cw_24ghz"]
    (tmp_path / "buses/set.yaml").write_text(f"like: aircraft_77ghz\nfiles:\n  - {line}\n")
    with pytest.raises(
        InputError, match=r"set\.yaml: expected files, a list of records, and like, one of"
    ):
        recordings(tmp_path)


@pytest.mark.slow
def test_each_network_says_something_of_every_labelled_window(tmp_path):
    """Two networks of two steps each: what they say is of no use, where it stands is."""
    (tmp_path / "inputs/vehicle_24ghz").mkdir(parents=True)
    drive(tmp_path / "inputs/vehicle_24ghz", 22050, label="Vehicle")
    block = load_yaml("config/measured/recognition.yaml")
    block |= {"size": 24, "echoes": {"train": 2, "validation": 1}, "receivers": 1}
    block["training"] |= {"steps": 2, "batch": 4, "validate_every": 1}
    (tmp_path / "recognition.yaml").write_text(yaml.safe_dump(block))
    asked = [
        "recognise",
        "--inputs",
        tmp_path / "inputs",
        "--recognition",
        tmp_path / "recognition.yaml",
        "--jobs",
        1,
    ]
    only = {
        "vehicle_24ghz": [
            {"repository": "a/b", "commit": "c", "folder": "", "files": {"drive.wav": "0"}}
        ]
    }
    (tmp_path / "only.yaml").write_text(yaml.safe_dump(only))
    for out, more in (
        ("trained", []),
        ("again", ["--reuse", "--only", str(tmp_path / "only.yaml")]),
    ):
        study(
            [
                *map(str, asked),
                "--models",
                str(tmp_path / "models"),
                "--out",
                str(tmp_path / out),
                *more,
            ]
        )
        # Another recording in the folder, which the list does not name.
        content = (tmp_path / "inputs/vehicle_24ghz/drive.wav").read_bytes()
        (tmp_path / "inputs/vehicle_24ghz/other.wav").write_bytes(content[:-2] + b"\1\0")
        record = (
            (tmp_path / "inputs/vehicle_24ghz/drive.yaml")
            .read_text()
            .replace("drive.wav", "other.wav")
        )
        (tmp_path / "inputs/vehicle_24ghz/other.yaml").write_text(record)
    rows = read_csv(tmp_path / "trained/measured-recognition.csv", *accuracy.RECOGNITION)
    assert [(row["radar"], row["seed"], row["file"], row["windows"]) for row in rows] == [
        ("cw_24ghz", seed, "drive.wav", "3") for seed in ("0", "1")
    ]
    assert all(sum(int(row[name]) for name in accuracy.COUNTED) == 3 for row in rows)
    assert read_csv(tmp_path / "again/measured-recognition.csv") == rows
    windows = read_csv(tmp_path / "trained/measured-windows.csv", *accuracy.WINDOWS)
    assert len(windows) == 6 and {row["label"] for row in windows} == {"Vehicle"}
    study(["labels", "--inputs", str(tmp_path / "inputs"), "--out", str(tmp_path / "trained")])
    assert (tmp_path / "trained/label-vehicle_24ghz-drive.wav.png").is_file()
    (tmp_path / "models/cw_24ghz-0").rename(tmp_path / "models/uav_3ghz-0")
    with pytest.raises(InputError, match="trained on the twin 'cw_24ghz', expected 'uav_3ghz'"):
        accuracy.loaded(tmp_path / "models/uav_3ghz-0/model.safetensors", "uav_3ghz")


def test_a_recording_counts_once_under_two_names(tmp_path, capsys, library):
    folder = tmp_path / "vehicle_24ghz"
    folder.mkdir()
    drive(folder, 22050, label="Vehicle")
    (folder / "a.wav").write_bytes((folder / "drive.wav").read_bytes())
    (folder / "a.yaml").write_text(
        (folder / "drive.yaml").read_text().replace("drive.wav", "a.wav")
    )
    found = usable(recordings(tmp_path), library)
    assert [one.name for one in found] == ["a.wav"]
    assert re.search(r"drive\.wav: the same bytes as .*a\.wav", capsys.readouterr().err)


def libraries():
    """The scenes that networks learn from, and those as they were recorded."""
    return Library.read(), Library.read(over=load_yaml(HERE / "recorded.yaml"))


def test_scenes_as_recorded_lie_over_those_that_networks_learn_from():
    learnt, recorded = libraries()
    assert recorded.twins == learnt.twins and recorded.seed == learnt.seed
    every = [block for blocks in load_yaml(SETS).values() for block in blocks]
    for twin in recorded.twins:
        held = {block["label"] for block in every if block["radar"] == twin}
        for category, scenes in recorded.scenes[twin].items():
            plain = [
                {key: item for key, item in scene.items() if key != "receiver"} for scene in scenes
            ]
            wider = [
                {key: item for key, item in scene.items() if key != "receiver"}
                for scene in learnt.scenes[twin][category]
            ]
            assert (plain == wider) == (category not in held)
    # A scene's own receiver settings lie over its twin's.
    drone, bird = (
        recorded.scenes["bird_drone_10ghz"][name][0]["receiver"] for name in ("UAV", "Bird")
    )
    assert drone["hum_db"] != bird["hum_db"] and drone["snr_db"] == bird["snr_db"]


def test_distances_of_one_test_recording_have_no_floor_and_stand_next_to_simulated_classes(
    tmp_path,
):
    (tmp_path / "walker_24ghz").mkdir()
    time = np.arange(12000) / 12000
    wave = np.cos(2 * np.pi * 200.0 * time) * (time > 0.3) + 0.01 * np.random.default_rng(
        0
    ).standard_normal(12000)
    wavfile.write(tmp_path / "walker_24ghz/new.wav", 12000, (10000 * wave).astype(np.int16))
    measured, (learnt, recorded) = recordings(tmp_path), libraries()
    rows = [
        dict(zip(DISTANCES, row, strict=True))
        for row in distance_rows("cw_24ghz", measured, learnt, recorded, ["texture_db"], 1)
    ]
    assert [row["figure"] for row in rows] == list(spectral_figures.INTERVAL)
    for row in rows:
        assert (
            np.isnan(row["floor"])
            and np.isnan(row["tuning"])
            and row["test"] == row["distance"] >= 0
        )
        assert row["label"] == "Pedestrian" and row["ceiling_class"].endswith(", simulated")
    assert any(row["learnt"] != row["distance"] for row in rows)
    assert distance_rows("uav_3ghz", measured, learnt, recorded, ["texture_db"], 1) == []


def test_the_page_shows_what_the_tables_and_pictures_hold(tmp_path):
    level = np.full((8, 5), -40.0, np.float32)
    level[3] = 0.0
    sides = dict.fromkeys(("measured", "simulated", "before"), level)
    times = np.arange(5.0)
    speeds = np.linspace(-2, 2, 8)
    np.savez(
        tmp_path / "pair-bird.npz",
        caption=np.array("a bird"),
        times_s=times,
        speeds_mps=speeds,
        **sides,
    )
    said = {
        "label": "Bird",
        "pair": "bird",
        "figure": "beat_hz",
        "unit": "Hz",
        "measured": "2.31",
        "class": "balanced",
    }
    for name, columns in {
        "figures": FIGURES,
        "distances": DISTANCES,
        "accuracy": accuracy.ACCURACY,
    }.items():
        write_csv(
            tmp_path / f"measured-{name}.csv",
            columns,
            [[said.get(column, "7") for column in columns]],
        )
    write_csv(
        tmp_path / "measured-recognition.csv",
        accuracy.RECOGNITION,
        [
            [
                {
                    "seed": "0",
                    "set": "birds",
                    "label": "Bird",
                    "file": name,
                    "right_percent": right,
                }.get(column, "7")
                for column in accuracy.RECOGNITION
            ]
            for name, right in (("good.csv", "96"), ("bad.csv", "12"))
        ],
    )
    (tmp_path / "label-birds-bad.csv.png").write_bytes(b"a picture")
    arguments = ["page", "--out", str(tmp_path)]
    study(arguments)
    page = (tmp_path / "report.html").read_text()
    picture = (tmp_path / "measured-bird.png").read_bytes()
    assert (
        "Held against measurement" in page and "2.31" in page and page.count("data:image/png") == 2
    )
    assert (
        page.index("<td>bad.csv") < page.index("<td>good.csv")
        and "labels of bad.csv of birds" in page
    )
    study(arguments)
    assert (tmp_path / "measured-bird.png").read_bytes() == picture
    for name in ("pair-bird.npz", "label-birds-bad.csv.png", "measured-bird.png"):
        (tmp_path / name).unlink()
    study(arguments)
    page = (tmp_path / "report.html").read_text()
    assert "2.31" in page and "data:image/png" not in page
    (tmp_path / "measured-figures.csv").unlink()
    with pytest.raises(InputError, match=r"measured-figures\.csv"):
        study(arguments)


def test_figures_of_known_signals():
    time = np.arange(400)
    tone = np.exp(2j * np.pi * 0.125 * time)
    found = spectral_figures.interval_figures(tone, 10.0, "both")
    assert found["line_mps"] == pytest.approx(2.5)
    assert found["edge_mps"] == pytest.approx(2.5, abs=0.15)
    noise = np.random.default_rng(0).standard_normal((2, 400))
    white = spectral_figures.interval_figures(noise[0] + 1j * noise[1], 10.0, "both")
    assert found["entropy"] < 0.3 < 0.85 < white["entropy"]
    assert found["kurtosis"] > 30 > 5 > white["kurtosis"]
    # Above half the symbol rate a one-sided real channel means speeds beyond the edge.
    assert spectral_figures.interval_figures(tone.conj(), 10.0, "wrapped")[
        "line_mps"
    ] == pytest.approx(17.5)
    beats = (1 + np.cos(2 * np.pi * np.arange(2000) / 50)) * np.ones((3, 1))
    assert spectral_figures.cycle_s(beats, 0.01, 0.2, 1.8) == pytest.approx(0.5, abs=0.011)


def test_a_passing_body_spreads_and_a_leaving_one_is_a_line():
    time = np.arange(12_000) / 6000.0
    wave = 0.0125
    speed = np.minimum(3.0 + 4.0 * time, 9.0)
    one = np.exp(4j * np.pi / wave * np.cumsum(speed) / 6000.0)
    other = np.exp(4j * np.pi / wave * np.cumsum(np.minimum(speed + 1.5, 9.0)) / 6000.0)
    noise = np.random.default_rng(0).standard_normal((2, len(time)))
    signal = one + other + 0.01 * (noise[0] + 1j * noise[1])
    spec = {"window": 512, "hop": 64, "slowest_mps": 1.0}
    found = class_figures.drive_figures(signal, 6000.0, wave, spec)
    assert found["speed_mps"] == pytest.approx(9.0, abs=0.15)
    # Two equal lines 1.5 m/s apart, each smeared by 0.34 m/s within a window: four fifths of the
    # energy.
    assert found["spread_mps"] == pytest.approx(1.6, abs=0.2)
    assert (
        class_figures.drive_figures(one + 0.01 * noise[0], 6000.0, wave, spec)["spread_mps"] < 0.4
    )


def test_a_harmonic_is_told_from_the_beat():
    time = np.arange(6000) / 1000.0
    beat = sum(np.exp(2j * np.pi * 2.4 * order * time) / order for order in (1, 2, 3))
    spec = {
        "window": 128,
        "hop": 8,
        "slowest_mps": 0.3,
        "fastest_mps": 3.0,
        "cycle_s": [0.2, 0.8],
        "harmonic_hz": [6.0, 8.5],
    }
    pulses = (0.5 + 0.5 * np.cos(2 * np.pi * 2.4 * time)) ** 4 * np.exp(2j * np.pi * 80 * time)
    found = class_figures.wing_figures(beat + pulses, 1000.0, 0.03, spec)
    assert found["beat_hz"] == pytest.approx(2.4, abs=0.12)
    assert found["harmonic_hz"] == pytest.approx(7.2, abs=0.05)
    assert found["harmonic_order"] == pytest.approx(3.0, abs=0.15)
    assert found["base_over_harmonic_db"] > 3


@pytest.mark.parametrize("spacing_hz", [80.0, 161.2])
def test_the_spacing_of_a_comb_is_read_off(spacing_hz):
    time = np.arange(6000) / 5000.0
    rng = np.random.default_rng(0)
    orders = np.arange(-9, 10)
    comb = np.exp(2j * np.pi * spacing_hz * np.outer(time, orders)) @ np.exp(
        2j * np.pi * rng.uniform(size=len(orders))
    )
    noise = rng.standard_normal((2, len(time)))
    signal = comb - comb.mean() + 0.1 * (noise[0] + 1j * noise[1])
    assert spectral_figures.line_spacing_hz(signal, 5000.0, 60.0, 500.0) == pytest.approx(
        spacing_hz, abs=3
    )


def test_the_sweeps_of_frames_without_pauses_follow_each_other(tmp_path):
    """Two frames of three sweeps at two distances."""
    values = np.arange(12.0).reshape(2, 3, 2)
    frames = np.empty(values.shape, [("real", "<i2"), ("imag", "<i2")])
    frames["real"] = values
    frames["imag"] = -values
    with h5py.File(tmp_path / "frames.h5", "w") as file:
        file["sessions/session_0/group_0/entry_0/result/frame"] = frames
    found = foreign.sweeps(tmp_path / "frames.h5", 1)
    np.testing.assert_array_equal(found, np.arange(1, 12, 2) * (1 - 1j))


def test_foreign_inputs_are_counted_and_a_hand_moves_at_its_speed(library):
    present = np.array([True, True, False, False, False])
    beyond = np.array([np.nan, np.nan, 31.0, np.nan, np.nan])
    shares = np.eye(4)[[1, 3, 0, 0, 0]]
    clipped = np.array([False, False, False, True, False])
    lost = np.zeros(5, bool)
    said = Answers(np.arange(5.0), present, shares, clipped, beyond, lost, 20.0, [])
    row = dict(
        zip(foreign.COLUMNS, foreign.row("net", "input", said, list(CATEGORIES)), strict=True)
    )
    counted = {name: row[name] for name in accuracy.COUNTED if row[name]}
    assert row["windows"] == 5 and counted == {
        "Bird": 1,
        "Pedestrian": 1,
        "nothing": 1,
        "beyond": 1,
        "clipped": 1,
    }
    twin = library.twins["cw_24ghz"]
    values = foreign.hand(twin, 0.5, np.random.default_rng(0))
    for part, fastest in zip(
        np.split(values - values.mean(), 2), (0.0, 2 * np.pi * 1.2 * 0.15), strict=True
    ):
        power = np.abs(np.fft.fft(part * np.hanning(len(part)))) ** 2
        speeds = np.abs(np.fft.fftfreq(len(part), 1 / twin.rate_hz)) * 299792458 / 24e9 / 2
        strong = speeds[(power > 1e3 * np.median(power)) & (speeds > 0.05)]
        assert strong.max(initial=0.0) == pytest.approx(fastest, abs=0.05)
