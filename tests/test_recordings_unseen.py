"""A recording nobody has seen: a WAV and five lines become spectra, tiles and a prediction, in mono or stereo.

Files of the public sets that came later, and folders that are no set yet, go through without a change of the code.
"""

import json
import re

import numpy as np
import pytest
import yaml
from scipy.io import wavfile

from lowalt.__main__ import main as lowalt
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.recordings.__main__ import main
from lowalt.recordings.library import Library
from lowalt.recordings.sets import measured_intervals, recordings, usable

SECONDS = 1.3
CARRIER = 24.0e9
SPEED = 6.0


def drive(folder, rate, stereo, swapped=False, **more):
    """Write a WAV of a target that leaves at SPEED from a fifth of a second on, and its record of five lines."""
    time = np.arange(round(SECONDS * rate)) / rate
    tone = np.exp(-2j * np.pi * 2 * SPEED * CARRIER / 299792458.0 * time) * (time > 0.2)
    noise = np.random.default_rng(0).standard_normal((2, len(time)))
    values = 0.2 * tone + 0.01 * (noise[0] + 1j * noise[1])
    pair = np.stack([values.real, values.imag][:: -1 if swapped else 1], axis=1)
    wavfile.write(folder / "drive.wav", rate, (20000 * (pair if stereo else pair[:, 0])).astype(np.int16))
    block = {"file": "drive.wav", "carrier_hz": CARRIER, "channel": "complex" if stereo else "real"}
    path = folder / "drive.yaml"
    path.write_text(yaml.safe_dump({**block, "source": "made here", "licence": "MIT", **more}))
    return path


@pytest.mark.parametrize("rate, stereo", [(8000, False), (44100, False), (22050, True), (96000, True)])
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
    assert set(spectra) == {"vrp", "trp", "vt"} and all(np.isfinite(spectra[name]).all() for name in spectra)


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    """A network of the 24 GHz radar, trained for two steps on its twin and kept as the zoo keeps its own."""
    folder = tmp_path_factory.mktemp("network")
    (folder / "inputs/vehicle_24ghz").mkdir(parents=True)
    drive(folder / "inputs/vehicle_24ghz", 22050, True, label="Vehicle")
    block = load_yaml("config/measured/recognition.yaml")
    block |= {"size": 24, "echoes": {"train": 2, "validation": 1}, "receivers": 1, "seeds": [0]}
    block["training"] |= {"steps": 2, "batch": 4, "validate_every": 1}
    (folder / "recognition.yaml").write_text(yaml.safe_dump(block))
    twins = load_yaml("config/measured/twins.yaml")
    del twins["twins"]["uav_3ghz"]
    for block in (twins, *twins["twins"].values()):
        for scene in (scene for scenes in block["scenes"].values() for scene in scenes):
            scene["subtypes"] = scene["subtypes"][:1]
    (folder / "twins.yaml").write_text(yaml.safe_dump(twins))
    shared = [
        "--twins",
        str(folder / "twins.yaml"),
        "--recognition",
        str(folder / "recognition.yaml"),
        "--models",
        str(folder / "models"),
        "--out",
    ]
    main(["recognise", "--inputs", str(folder / "inputs"), *shared, str(folder), "--jobs", "1"])
    assert [row["file"] for row in read_csv(folder / "measured-recognition.csv")] == ["drive.wav"] * 2
    main(["keep", *shared, str(folder / "zoo")])
    # The radar without a recording gets a network of its own.
    assert {path.name for path in (folder / "zoo").iterdir()} == {
        f"{name}.{kind}" for name in ("bird_drone_10ghz", "cw_24ghz") for kind in ("md", "safetensors")
    }
    return folder / "zoo/cw_24ghz.safetensors"


def test_a_prediction_names_every_window_and_says_which_hold_a_target(network, tmp_path, capsys):
    path = drive(tmp_path, 44100, True)
    assert lowalt(["predict", str(network), str(path), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["start_s"] for row in rows] == pytest.approx([0, 0.4, 0.8])
    for row in rows:
        shares = {name: row[name] for name in ("UAV", "Bird", "Vehicle", "Pedestrian")}
        assert row["target"] and sum(shares.values()) == pytest.approx(1)
        assert row["class"] == max(shares, key=shares.__getitem__)
    assert lowalt(["predict", str(network), str(path)]) == 0
    assert "3 of 3 windows hold a target: " in capsys.readouterr().out


@pytest.mark.parametrize("model, file, changes, words", [
    ("", "drive.yaml", {"carrier_hz": 3.4e9}, "carrier_hz is 3.4e+09, .*expected a network of .*uav_3ghz"),
    ("", "drive.yaml", {"carrier_hz": 5.8e9}, "carrier_hz is 5.8e+09, .*the zoo has none"),
    ("uav_3ghz", "drive.yaml", {"carrier_hz": 3.4e9, "channel": "real"}, "expected in-phase and quadrature"),
    ("", "signals.npy", {}, "knows recordings, expected the record of one"),
    ("default-seen", "drive.yaml", {}, "knows no recordings, expected a network of a radar"),
])  # fmt: skip
def test_what_a_network_does_not_know_is_refused(network, tmp_path, capsys, model, file, changes, words):
    drive(tmp_path, 22050, changes.get("channel") != "real", **changes)
    np.save(tmp_path / "signals.npy", np.ones((1, 1200), np.complex64))
    assert lowalt(["predict", model or str(network), str(tmp_path / file)]) == 2
    assert re.search(words.replace("+", r"\+"), capsys.readouterr().err)


def test_swapped_channels_are_refused_where_the_direction_is_known(tmp_path):
    call = ["import", "--radar", "cw_24ghz", "--out", str(tmp_path / "out"), "--record"]
    main([*call, str(drive(tmp_path, 22050, True, moves="away"))])
    with pytest.raises(InputError, match="channels swapped, the record says the target moves away"):
        main([*call, str(drive(tmp_path, 22050, True, swapped=True, moves="away"))])
    # Where nobody knows the direction, the one channel that this radar has hears the same speed.
    main([*call, str(drive(tmp_path, 22050, True, swapped=True))])


def test_a_record_next_to_a_new_file_goes_before_the_sets_pattern(tmp_path):
    folder = tmp_path / "vehicle_24ghz"
    folder.mkdir()
    drive(folder, 22050, True, label="Pedestrian")
    (one,) = recordings(tmp_path, "config/measured/sets.yaml", "config/measured/split.yaml")
    assert (one.name, one.half, one.record.label, one.record.channel) == ("drive.wav", "test", "Pedestrian", "complex")
    drive(folder, 22050, True)
    with pytest.raises(InputError, match=r"drive.yaml: no label, expected one of"):
        recordings(tmp_path, "config/measured/sets.yaml", "config/measured/split.yaml")


SETS, SPLIT = "config/measured/sets.yaml", "config/measured/split.yaml"


def volts(folder, name, rate, seconds=1.0):
    """Write a CSV of the set at 10 GHz: volts and sample times."""
    folder.mkdir(exist_ok=True)
    time = np.arange(round(rate * seconds)) / rate
    wave = np.sin(2 * np.pi * 60.0 * time) + 0.01 * np.random.default_rng(1).standard_normal(len(time))
    rows = np.stack([wave, time], axis=1)
    np.savetxt(folder / name, rows, delimiter=",", header="V,timestamps", comments="", fmt="%.9g")


def test_later_files_of_a_set_may_have_another_rate_and_bad_ones_are_left_out_by_name(tmp_path, capsys):
    folder = tmp_path / "bird_drone_10ghz"
    volts(folder, "bird99.csv", 10000)
    volts(folder, "bird98.csv", 20000)
    volts(folder, "DRONE97.CSV", 10000)
    volts(folder, "bird96.csv", 8000)
    volts(folder, "bird95.csv", 10000, seconds=0.2)
    volts(folder, "quadcopter.csv", 10000)
    twin = Library.read("config/measured/twins.yaml").twins["bird_drone_10ghz"]
    found = usable(recordings(tmp_path, SETS, SPLIT), {"bird_drone_10ghz": twin})
    assert {one.name: one.record.label for one in found} == {
        "bird99.csv": "Bird", "bird98.csv": "Bird", "DRONE97.CSV": "UAV",
    }  # fmt: skip
    assert {one.half for one in found} == {"test"}
    for one in found:
        # 60 Hz stand at 60 Hz, whichever of the set's rates the file has.
        power = np.abs(np.fft.fft(measured_intervals(one, twin)[0])) ** 2
        assert power.argmax() / len(power) * 1000.0 == pytest.approx(60.0, abs=2.5)
    told = capsys.readouterr().err
    assert "quadcopter.csv: left out" in told
    assert "bird96.csv: wrong rate" in told and "bird95.csv: 200 symbols, shorter than one window" in told
    with pytest.raises(InputError, match="none of 1 recordings can be used"):
        usable(
            [one for one in recordings(tmp_path, SETS, SPLIT) if one.name == "bird95.csv"], {"bird_drone_10ghz": twin}
        )


def test_the_carrier_stands_in_the_name_of_later_files(tmp_path):
    folder = tmp_path / "uav_3ghz"
    folder.mkdir()
    for name in ("DJI_Hovering_on_Rotors_Foil_10000000__Freq_3.400__Sample_2.mat", "renamed.mat"):
        (folder / name).write_bytes(b"")
    found = {one.name: one.record.carrier_hz for one in recordings(tmp_path, SETS, SPLIT)}
    assert sorted(found.values()) == [3.3e9, 3.4e9] and found["renamed.mat"] == 3.3e9


def test_a_folder_that_is_no_set_becomes_one_by_a_file(tmp_path, capsys):
    (tmp_path / "buses").mkdir()
    drive(tmp_path / "buses", 22050, False)
    (tmp_path / "buses/drive.yaml").unlink()
    with pytest.raises(InputError, match="no recordings of"):
        recordings(tmp_path, SETS, SPLIT)
    assert "buses: left out, no set of that name and no set.yaml in it" in capsys.readouterr().err
    own = tmp_path / "buses/set.yaml"
    line = '{file: "*.wav", carrier_hz: 24.0e+9, channel: real, label: Vehicle, source: made here, licence: MIT}'
    own.write_text(f"like: vehicle_24ghz\nfiles:\n  - {line}\n")
    (one,) = recordings(tmp_path, SETS, SPLIT)
    assert (one.set, one.like, one.half, one.name) == ("buses", "vehicle_24ghz", "test", "drive.wav")
    own.write_text(f"like: aircraft_77ghz\nfiles:\n  - {line}\n")
    with pytest.raises(InputError, match=r"set\.yaml: expected files, a list of records, and like, one of"):
        recordings(tmp_path, SETS, SPLIT)
