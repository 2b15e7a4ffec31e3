"""A recording of unknown layout is read at the first or second try; misreadings are refused."""

import json
import re
import runpy
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.io import wavfile

from lowalt.__main__ import main as lowalt
from lowalt.extensions.recordings import read, read_record, recording_picture
from lowalt.extensions.recordings.evidence import chirp_length
from lowalt.extensions.recordings.file_inspection import inspect_recording
from lowalt.extensions.recordings.record import record
from lowalt.files.errors import InputError

WRITTEN = runpy.run_path(str(Path(__file__).parents[3] / "benchmarks/recording_layouts.py"))
LAYOUTS = WRITTEN["LAYOUTS"]
CARRIER = WRITTEN["CARRIER_HZ"]
RATE = WRITTEN["RATE_HZ"]


def echo(kind="walker", snr_db=10):
    return WRITTEN["echo"](kind, snr_db, np.random.default_rng(5))


def stated(path, channel="complex", **more):
    block = {"file": path.name, "carrier_hz": CARRIER, "rate_hz": RATE, "channel": channel, **more}
    return record(block, path.parent, "here")


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(
    "kind, snr", [("walker", 10), pytest.param("point", 30, marks=pytest.mark.slow)]
)
def test_every_layout_is_read_at_the_first_or_second_try(layout, kind, snr, tmp_path):
    values = echo(kind, snr)
    path = WRITTEN["written"](layout, values, tmp_path)
    assert WRITTEN["tries"](path, values) <= 2


def test_two_commands_lead_from_a_file_to_an_answer(tmp_path, capsys, monkeypatch):
    values = echo()
    path = WRITTEN["written"]("int16 dca2", values, tmp_path)
    root = Path.cwd()
    monkeypatch.chdir(tmp_path)
    line = ["recording", "inspect", path.name, "--carrier", "3.3e9", "--rate", "5000"]
    assert lowalt(line) == 0
    said = capsys.readouterr().out
    assert (
        re.search(r"\+(2\.9|3\.0)\d m/s", said.splitlines()[1])
        and "next     lowalt predict uav_3ghz a.yaml" in said
    )
    assert "GUESSED" in (tmp_path / "a.yaml").read_text() and (tmp_path / "a-inspect.png").is_file()
    (tmp_path / "results").mkdir()
    (tmp_path / "results/zoo").symlink_to(root / "results/zoo")
    (tmp_path / "config").symlink_to(root / "config")
    assert lowalt(["predict", "uav_3ghz", "a.yaml"]) == 0
    assert "windows hold a target" in capsys.readouterr().out
    # A record that somebody wrote is not written over; a draft is, by another reading.
    assert lowalt([*line, "--take", "2"]) == 0
    draft = (tmp_path / "a.yaml").read_text()
    for kept in ("file: mine\n", draft + "empty_s: [0, 3]\n", draft.replace("int16", "uint16")):
        assert kept != draft
        (tmp_path / "a.yaml").write_text(kept)
        assert lowalt(line) == 2
        assert "a.yaml: is there already and no draft" in capsys.readouterr().err
        assert (tmp_path / "a.yaml").read_text() == kept


def test_without_a_carrier_the_next_command_asks_for_it(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = WRITTEN["written"]("stereo WAV", echo(), tmp_path)
    assert lowalt(["recording", "inspect", path.name, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (
        facts["next"] == "lowalt recording inspect stereo.wav --carrier HZ"
        and facts["text"] is None
    )
    assert facts["rate_hz"] == RATE and facts["readings"][0]["keys"] == {
        "channel": "complex",
        "columns": [0, 1],
    }


@pytest.mark.parametrize("kind", ["stereo WAV", "csv"])
def test_the_draft_of_a_rate_that_the_file_contradicts_is_read(kind, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if kind == "csv":
        path = tmp_path / "a.csv"
        values = echo()
        columns = [np.arange(len(values)) / RATE, values.real, values.imag]
        np.savetxt(path, np.stack(columns, 1), delimiter=",", header="time_s,I,Q", comments="")
    else:
        path = WRITTEN["written"](kind, echo(), tmp_path)
    line = ["recording", "inspect", path.name, "--carrier", "3.3e9", "--rate", "4000"]
    assert lowalt(line) == 0
    said = capsys.readouterr().out
    assert "note: the file states a rate of 5000 Hz: with `trust: record` the stated 4000" in said
    assert read(read_record(path.with_suffix(".yaml"))).rate_hz == 4000


def test_hum_a_constant_part_and_an_image_are_pointed_out(tmp_path):
    times = np.arange(20000) / RATE
    hum = sum(np.cos(2 * np.pi * 50 * number * times) / number for number in (1, 2, 3))
    noise = np.random.default_rng(0).standard_normal((2, 20000))
    values = 30 + np.exp(2j * np.pi * 700 * times) + 0.2 * hum + 0.01 * (noise[0] + 1j * noise[1])
    np.save(tmp_path / "a.npy", values)
    notes = " ".join(inspect_recording(tmp_path / "a.npy", CARRIER, RATE).notes)
    assert "hum of the mains: narrow lines at 50, 100, 150 Hz" in notes
    assert (
        "a constant part stands 29 dB above the rest" in notes and "opposite Doppler" not in notes
    )
    np.save(tmp_path / "b.npy", values.real + 0.3j * values.imag)
    notes = " ".join(inspect_recording(tmp_path / "b.npy", CARRIER, RATE).notes)
    assert "image at the opposite Doppler, 5 dB below" in notes


def test_noise_has_no_image_and_a_moving_target_heard_with_unequal_channels_has_one(tmp_path):
    def image(values):
        np.save(tmp_path / "a.npy", values)
        return "image at the opposite Doppler" in " ".join(
            inspect_recording(tmp_path / "a.npy", CARRIER, RATE).notes
        )

    times = np.arange(20000) / RATE
    moving = np.exp(2j * np.pi * np.cumsum(200 + 150 * np.sin(2 * np.pi * 0.7 * times)) / RATE)
    for seed in range(3):
        pair = np.random.default_rng(seed).standard_normal((2, 20000))
        white = pair[0] + 1j * pair[1]
        spectrum = np.fft.fft(white) / np.maximum(np.abs(np.fft.fftfreq(20000, 1 / RATE)), 5)
        rounded = np.rint(127.5 + 20 * pair[0]) + 1j * np.rint(127.5 + 20 * pair[1])
        for noise in (
            white,
            np.fft.ifft(spectrum),
            rounded,
            white[:1000],
            white * (1 + 5 * (times % 1 < 0.1)),
        ):
            assert not image(noise), seed
        assert not image(moving + 0.5 * white)
        heard = moving + 0.3 * white
        assert image(heard.real + 0.5j * heard.imag)


def test_powers_are_told_from_samples(tmp_path):
    rng = np.random.default_rng(3)
    powers = rng.exponential(1.0, (300, 128)) * np.exp(-np.arange(128) / 20)
    powers.astype(np.float32).tofile(tmp_path / "a.bin")
    assert "read as float32 no number is negative" in inspect_recording(tmp_path / "a.bin").notes[0]
    np.save(tmp_path / "a.npy", powers.ravel())
    assert inspect_recording(tmp_path / "a.npy").notes[0].startswith("no number is negative")
    wave = np.sin(0.07 * np.arange(38400)) + 0.2 * rng.standard_normal(38400)
    for bits in (8, 12, 14, 16):
        # Unsigned samples of a converter over most of its range.
        np.clip(np.rint(2 ** (bits - 1) * (1 + 0.6 * wave)), 0, 2**bits - 1).astype(
            np.uint16
        ).tofile(tmp_path / "b.bin")
        assert "no number is negative" not in " ".join(
            inspect_recording(tmp_path / "b.bin").notes
        ), bits


def test_the_picture_shows_the_speeds_that_there_are_and_says_whose_sign_is_lost(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(recording_picture, "png", lambda figure: figure.axes[0])
    times = np.arange(4 * 44100) / 44100
    swing = np.cos(2 * np.pi * np.cumsum(320 + 160 * np.sin(3 * times)) / 44100)
    wavfile.write(tmp_path / "a.wav", 44100, np.rint(9000 * swing).astype(np.int16))
    panel = recording_picture.recording_picture(
        inspect_recording(tmp_path / "a.wav", 24e9), ["one"]
    )
    # 480 Hz is 3 m/s; the samples would show 138.
    assert (
        panel.get_ylim()[0] == 0
        and 3 < panel.get_ylim()[1] < 5
        and panel.get_ylabel().endswith("sign lost")
    )
    np.save(tmp_path / "b.npy", np.random.default_rng(0).standard_normal((2, 20000)).T)
    panel = recording_picture.recording_picture(
        inspect_recording(tmp_path / "b.npy", 24e9, 44100), ["one"]
    )
    assert panel.get_ylim()[1] > 130


WRONG = {
    "planar called interleaved": (
        "int16 iiqq",
        {"dtype": "int16", "layout": "iqiq"},
        "layout 'iiqq'|one real channel",
    ),
    "interleaved called planar": (
        "int16 iqiq",
        {"dtype": "int16", "layout": "iiqq"},
        "layout 'iqiq'",
    ),
    "big-endian": (
        "int16 big-endian",
        {"dtype": "int16", "layout": "iqiq"},
        "dtype 'int16_be' and layout 'iqiq'",
    ),
    "float32 called int16": (
        "float32 iqiq",
        {"dtype": "int16", "layout": "iqiq"},
        "dtype 'float32' and layout 'iqiq'",
    ),
    "unsigned called signed": (
        "uint8 iqiq",
        {"dtype": "int8", "layout": "iqiq"},
        "dtype 'uint8' and layout 'iqiq'",
    ),
    "two lanes called interleaved": (
        "int16 dca2",
        {"dtype": "int16", "layout": "iqiq"},
        "layout 'dca2'",
    ),
    "two lanes called planar": (
        "int16 dca2",
        {"dtype": "int16", "layout": "iiqq"},
        "layout 'dca2'",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_record_that_its_numbers_contradict_is_refused(name, tmp_path):
    layout, keys, expected = WRONG[name]
    path = WRITTEN["written"](layout, echo("walker", 20), tmp_path)
    with pytest.raises(InputError, match=f"do not follow on one another.*{expected}"):
        read(stated(path, **keys))
    if "int16" in layout:  # others wrap or hold no finite number, which is refused for itself
        assert len(read(stated(path, trust="record", **keys)).values)


@pytest.mark.parametrize(
    "layout, keys",
    [
        ("int16 iqiq", {"dtype": "int16", "layout": "iqiq"}),
        ("int16 iiqq", {"dtype": "int16", "layout": "iiqq"}),
        ("int16 big-endian", {"dtype": "int16_be", "layout": "iqiq"}),
        ("uint8 iqiq", {"dtype": "uint8", "layout": "iqiq"}),
        ("int16 dca2", {"dtype": "int16", "layout": "dca2"}),
        ("float32 .cfile", {}),
        ("uint8 .cu8", {}),
    ],
)
@pytest.mark.parametrize(
    "kind, snr", [("drone", 30), pytest.param("drone", 0, marks=pytest.mark.slow), ("walker", 0)]
)
def test_a_right_record_is_never_refused(layout, keys, kind, snr, tmp_path):
    values = echo(kind, snr)
    path = WRITTEN["written"](layout, values, tmp_path)
    found = read(stated(path, trust=None, **keys)).values
    assert abs(np.vdot(found - found.mean(), values - values.mean())) > 0.99 * np.linalg.norm(
        found - found.mean()
    ) * np.linalg.norm(values - values.mean())


def test_names_of_columns_outrank_guesses_and_contradictions_are_refused(tmp_path):
    values = echo()
    path = WRITTEN["written"]("CSV Q,I", values, tmp_path)
    np.testing.assert_allclose(read(stated(path)).values, values, atol=1e-5)
    with pytest.raises(InputError, match=r"the columns \['Q', 'I'\] are q and i by their names"):
        read(stated(path, columns=["Q", "I"]))
    path = WRITTEN["written"]("CSV mag,phase", values, tmp_path)
    np.testing.assert_allclose(read(stated(path)).values, values, atol=1e-5)
    with pytest.raises(InputError, match=r"are magnitude and phase by their names"):
        read(stated(path, columns=["mag", "phase"]))
    path = WRITTEN["table"](tmp_path, "t,V", np.arange(len(values)) / RATE, values.real)
    with pytest.raises(InputError, match="1 columns, expected one complex or two"):
        read(stated(path))
    np.testing.assert_allclose(read(stated(path, "real")).values, values.real, atol=1e-5)
    path = WRITTEN["table"](tmp_path, "a,b", np.arange(len(values)) / RATE, values.real)
    with pytest.raises(InputError, match="column 'a' rises by equal steps, as sample times do"):
        read(stated(path))
    # Milliseconds by their name give the rate.
    path = WRITTEN["table"](
        tmp_path, "t_ms,I,Q", np.arange(len(values)) / 5, values.real, values.imag
    )
    assert read(stated(path, rate_hz=None)).rate_hz == pytest.approx(RATE, rel=1e-6)


def first_of(path, carrier):
    """The first reading of a file of captures that do not belong together.

    An inspection points this out.
    """
    seen = inspect_recording(path, carrier, RATE)
    assert "the record takes the first" in " ".join(seen.notes)
    return seen.readings[0]


def test_captures_apart_are_not_joined(tmp_path):
    pytest.importorskip("sigmf")
    values = echo()
    path = WRITTEN["written"]("SigMF float32", values, tmp_path)
    about = json.loads(path.read_text())
    about["captures"] = [
        {"core:sample_start": 0, "core:datetime": "2026-01-01T00:00:00Z"},
        {"core:sample_start": 5000, "core:datetime": "2026-01-01T01:00:00Z"},
    ]
    path.write_text(json.dumps(about))
    with pytest.raises(
        InputError, match="capture at sample 5000 begins 3599 s after the samples before it end"
    ):
        read(stated(path))
    np.testing.assert_allclose(read(stated(path, capture=1)).values, values[5000:], rtol=1e-5)
    assert first_of(path, CARRIER).keys["capture"] == 0
    other = [
        {"core:sample_start": 0, "core:frequency": CARRIER},
        {"core:sample_start": 5000, "core:frequency": 3.6e9},
    ]
    path.write_text(json.dumps({**about, "captures": other}))
    for carrier in (None, CARRIER):
        assert len(first_of(path, carrier).values) == 5000
    about["captures"][1]["core:datetime"] = "2026-01-01T00:00:01Z"
    path.write_text(json.dumps(about))
    assert len(read(stated(path)).values) == len(values)


def test_a_wav_of_one_channel_is_one_real_channel_even_where_its_numbers_repeat(tmp_path):
    tone = np.sin(2 * np.pi * 60 * np.arange(88_200) / 44_100)
    wavfile.write(tmp_path / "a.wav", 44_100, np.rint(20_000 * tone).astype(np.int16))
    first = inspect_recording(tmp_path / "a.wav", 24e9).readings[0]
    assert (
        first.keys == {"channel": "real"}
        and first.said
        and first.line_hz == pytest.approx(60, abs=0.5)
    )


def test_a_wav_without_samples_is_refused(tmp_path):
    wavfile.write(tmp_path / "a.wav", 5000, np.zeros((0, 2), np.int16))
    with pytest.raises(InputError, match=re.escape("a.wav: ")):
        read(stated(tmp_path / "a.wav"))
    with pytest.raises(InputError, match=re.escape("a.wav: ")):
        inspect_recording(tmp_path / "a.wav")


@pytest.mark.parametrize("real", [False, True])
def test_chirps_give_the_speed_and_its_sign(real, tmp_path):
    values = echo("point", 20)
    stream = WRITTEN["chirped"](values)
    assert chirp_length(stream)[0] == 64
    assert chirp_length(values)[0] == 0
    np.save(tmp_path / "a.npy", (stream.real if real else stream).reshape(-1, 64))
    for more in ({}, {"moves": "towards"}):
        found = read(stated(tmp_path / "a.npy", chirps={"samples": 64}, **more))
        power = np.abs(np.fft.fft((found.values - found.values.mean()) * np.hanning(512)))
        assert np.fft.fftfreq(512, 1 / RATE)[power.argmax()] == pytest.approx(
            2 * 3 / WRITTEN["WAVE_M"], abs=10
        )
    # Conjugate samples are those of a mixer wired the other way: the beat note tells, so the speed
    # keeps its sign.
    np.save(tmp_path / "b.npy", stream.conj().reshape(-1, 64))
    other = read(stated(tmp_path / "b.npy", chirps={"samples": 64}, moves="towards")).values
    assert np.fft.fftfreq(512)[np.abs(np.fft.fft(other - other.mean())).argmax()] > 0


def test_a_draft_is_a_record_without_source_or_licence(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    values = echo()
    path = WRITTEN["written"]("int16 big-endian", values, tmp_path)
    assert lowalt(["recording", "inspect", str(path), "--carrier", "3.3e9", "--rate", "5000"]) == 0
    block = yaml.safe_load((tmp_path / "a.yaml").read_text())
    assert block == {
        "file": "a.bin",
        "carrier_hz": CARRIER,
        "rate_hz": RATE,
        "channel": "complex",
        "layout": "iqiq",
        "dtype": "int16_be",
    }
    assert len(read(read_record("a.yaml")).values) == len(values)
