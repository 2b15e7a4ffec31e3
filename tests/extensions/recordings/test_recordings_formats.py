"""The formats that receivers write.

Raw numbers, structs, MAT 7.3, semicolons, complex cells, channels and captures of SigMF.
"""

import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.io import savemat, wavfile

from lowalt.extensions.recordings import read, read_record
from lowalt.extensions.recordings.faults import clipped, lost
from lowalt.extensions.recordings.file_inspection import inspect_recording
from lowalt.extensions.recordings.files import Baseband
from lowalt.extensions.recordings.record import Record, record
from lowalt.extensions.recordings.twin import radars
from lowalt.extensions.recordings.windows import looks
from lowalt.files.errors import InputError

RATE = 12000.0
FAULTS = Path(__file__).parents[3] / "shared/data/faults/recordings"
FAULTS = FAULTS if FAULTS.is_dir() else Path(__file__).parents[4] / "shared/data/faults/recordings"


def wave(count: int = 6000) -> np.ndarray:
    """Complex samples of two lines and some noise."""
    time = np.arange(count) / RATE
    noise = np.random.default_rng(3).standard_normal((2, count))
    return (
        8000 * np.exp(400j * np.pi * time)
        + 900 * np.exp(-900j * np.pi * time)
        + 5 * (noise[0] + 1j * noise[1])
    )


def entry(folder: Path, file: str, channel: str = "complex", **more):
    block = {
        "file": file,
        "carrier_hz": 24e9,
        "channel": channel,
        "source": "made",
        "licence": "MIT",
        "rate_hz": RATE,
    }
    return record(block | more, folder, "here")


def pairs(values: np.ndarray) -> np.ndarray:
    """I and Q in turn."""
    return np.stack([values.real, values.imag], axis=1).ravel()


@pytest.mark.parametrize(
    "file, dtype, layout",
    [
        ("a.iq", "int16", "iqiq"),
        ("a.bin", "float32", "iiqq"),
        ("a.cfile", None, None),
        ("a.npy", "int16", "iqiq"),
        ("a.iq", "int8", "iqiq"),
        ("a.bin", "complex128", None),
    ],
)
def test_raw_numbers_and_both_layouts_give_the_samples(tmp_path, file, dtype, layout):
    values = wave() / (80 if dtype == "int8" else 1)
    flat = pairs(values) if layout == "iqiq" else np.concatenate([values.real, values.imag])
    stored = (flat if layout else values).astype(dtype or "complex64")
    np.save(tmp_path / file, stored) if file == "a.npy" else stored.tofile(tmp_path / file)
    more = {"layout": layout} if layout else {}
    more |= {"dtype": dtype} if dtype and file != "a.npy" else {}
    np.testing.assert_allclose(read(entry(tmp_path, file, **more)).values, values, atol=1.5)


def test_cut_and_unknown_raw_files_are_refused(tmp_path):
    (tmp_path / "a.iq").write_bytes(b"12345")
    with pytest.raises(
        InputError, match=r"a.iq: nothing says the type of its numbers, expected dtype"
    ):
        read(entry(tmp_path, "a.iq", layout="iqiq"))
    with pytest.raises(
        InputError, match=r"a.iq: 5 bytes, expected whole numbers of 2 bytes \(int16\)"
    ):
        read(entry(tmp_path, "a.iq", layout="iqiq", dtype="int16"))
    np.arange(7, dtype=np.int16).tofile(tmp_path / "a.iq")
    with pytest.raises(
        InputError, match=r"a.iq: 7 numbers int16, expected an even number of real ones for layout"
    ):
        read(entry(tmp_path, "a.iq", layout="iqiq", dtype="int16"))


@pytest.mark.parametrize(
    "cell", ["{:.3f}{:+.3f}j", "({:.3f}{:+.3f}j)", "{:.3f}{:+.3f}i", "{:.3f} {:+.3f}i"]
)
def test_complex_cells_are_read_however_they_are_written(tmp_path, cell):
    values = wave(500)
    lines = [cell.format(value.real, value.imag) for value in values]
    (tmp_path / "a.csv").write_text("iq\n" + "\n".join(lines) + "\n")
    np.testing.assert_allclose(read(entry(tmp_path, "a.csv")).values, values, atol=1e-3)


@pytest.mark.parametrize("decimal", [".", ","])
def test_semicolons_and_decimal_commas_are_read(tmp_path, decimal):
    values = wave(500)
    lines = [
        f"{n / RATE:.9f};{v.real:.3f};{v.imag:.3f}".replace(".", decimal)
        for n, v in enumerate(values)
    ]
    (tmp_path / "a.csv").write_text("t;I;Q\n" + "\n".join(lines) + "\n")
    found = read(entry(tmp_path, "a.csv", columns=["I", "Q"], times="t", rate_hz=None))
    np.testing.assert_allclose(found.values, values, atol=1e-3)
    assert found.rate_hz == pytest.approx(RATE, rel=1e-5)


@pytest.mark.parametrize("between", [" ", "\t", "   "])
@pytest.mark.parametrize("names", [True, False])
def test_blanks_and_tabs_separate_columns_of_text(tmp_path, between, names):
    values = wave(500)
    lines = [["I", "Q"]] * names + [[f"{value.real:.3f}", f"{value.imag:.3f}"] for value in values]
    (tmp_path / "a.txt").write_text("\n".join(map(between.join, lines)) + "\n")
    np.testing.assert_allclose(read(entry(tmp_path, "a.txt")).values, values, atol=1e-3)


def test_a_field_of_a_struct_is_named_with_a_dot(tmp_path):
    values = wave()
    savemat(tmp_path / "a.mat", {"rec": {"iq": values, "fs": RATE, "about": {"note": "x"}}})
    np.testing.assert_array_equal(read(entry(tmp_path, "a.mat", variable="rec.iq")).values, values)
    np.testing.assert_array_equal(read(entry(tmp_path, "a.mat")).values, values)
    with pytest.raises(
        InputError, match=r"a.mat: no variable 'rec.x', expected one of \['rec.fs', 'rec.iq'\]"
    ):
        read(entry(tmp_path, "a.mat", variable="rec.x"))


def test_version_7_3_is_read_and_nothing_outside_the_file(tmp_path):
    h5py = pytest.importorskip("h5py")
    values = wave()
    with h5py.File(tmp_path / "other.mat", "w") as file:
        file["secret"] = np.arange(100.0)
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        pair = np.zeros((1, len(values)), [("real", "<f8"), ("imag", "<f8")])
        pair["real"], pair["imag"] = values.real, values.imag
        file["rec/iq"] = pair
        file["rec/outside"] = h5py.ExternalLink("other.mat", "secret")
        file["#refs#/a"] = np.arange(9.0)
        file["rec/again"] = file["rec"]
    np.testing.assert_array_equal(read(entry(tmp_path, "a.mat", variable="rec.iq")).values, values)
    with pytest.raises(InputError, match=r"no variable 'rec.outside'"):
        read(entry(tmp_path, "a.mat", variable="rec.outside"))
    with h5py.File(tmp_path / "b.mat", "w") as file:
        file.create_dataset("iq", (10**12,), "f8", chunks=(1000,))
    with pytest.raises(
        InputError, match=r"b.mat: not a readable .mat file \(iq has 8000000000000 bytes, more"
    ):
        read(entry(tmp_path, "b.mat"))


def sigmf_file(folder: Path, values: np.ndarray, captures: list[dict], **more) -> None:
    """Write a SigMF recording of complex values."""
    values.astype(np.complex64).tofile(folder / "a.sigmf-data")
    about = {"core:datatype": "cf32_le", "core:sample_rate": RATE, "core:version": "1.0.0"} | more
    captures = [{f"core:{key}": value for key, value in capture.items()} for capture in captures]
    (folder / "a.sigmf-meta").write_text(
        json.dumps({"global": about, "captures": captures, "annotations": []})
    )


def test_channels_and_late_captures_of_sigmf(tmp_path):
    pytest.importorskip("sigmf")
    values = wave()
    sigmf_file(
        tmp_path,
        np.stack([values, 2 * values], axis=1).ravel(),
        [{"sample_start": 0}],
        **{"core:num_channels": 2},
    )
    found = read(entry(tmp_path, "a.sigmf-meta", columns=[1], rate_hz=None))
    np.testing.assert_allclose(found.values, 2 * values, rtol=1e-6)
    with pytest.raises(InputError, match="2 columns, expected one complex or two"):
        read(entry(tmp_path, "a.sigmf-meta"))
    sigmf_file(tmp_path, values, [{"sample_start": 1000, "frequency": 24e9}])
    np.testing.assert_allclose(
        read(entry(tmp_path, "a.sigmf-meta")).values, values[1000:], rtol=1e-6
    )


@pytest.mark.parametrize("carriers", [[77e9], [24e9, 24.2e9]])
def test_captures_at_another_carrier_are_refused(tmp_path, carriers):
    pytest.importorskip("sigmf")
    starts = [{"sample_start": 100 * n, "frequency": carrier} for n, carrier in enumerate(carriers)]
    sigmf_file(tmp_path, wave(), starts)
    with pytest.raises(
        InputError, match=re.escape(f"a capture at {carriers[-1]:.6g} Hz, expected the record's")
    ):
        read(entry(tmp_path, "a.sigmf-meta"))


def test_sigmf_opens_no_file_elsewhere(tmp_path):
    pytest.importorskip("sigmf")
    sigmf_file(tmp_path, wave(), [{"sample_start": 0}], **{"core:dataset": "../secret.bin"})
    with pytest.raises(
        InputError, match=r"core:dataset is '../secret.bin', expected the name of a file beside it"
    ):
        read(entry(tmp_path, "a.sigmf-meta"))


@pytest.mark.parametrize("dataset", [False, True], ids=["its own file", "core:dataset"])
@pytest.mark.parametrize("headers", [(16, 0), (0, 24), (5, 3)])
@pytest.mark.parametrize("trailing", [0, 16, 7])
def test_bytes_that_sigmf_declares_to_be_no_samples_are_not_read(
    tmp_path, headers, trailing, dataset
):
    """Each capture begins behind its header.

    The last sample stands before the trailing bytes.
    """
    pytest.importorskip("sigmf")
    values = wave().astype(np.complex64)
    captures = [
        {"sample_start": start, "header_bytes": count}
        for start, count in zip((0, 2000), headers, strict=True)
    ]
    more = {"core:trailing_bytes": trailing} if trailing else {}
    if dataset:
        more |= {"core:dataset": "raw.bin"}
    sigmf_file(tmp_path, values, captures, **more)
    own = tmp_path / "a.sigmf-data"
    held = (
        b"\x7f" * headers[0]
        + values[:2000].tobytes()
        + b"\x7e" * headers[1]
        + values[2000:].tobytes()
        + b"\x7d" * trailing
    )
    own.write_bytes(held)
    if dataset:
        own.rename(tmp_path / "raw.bin")
    np.testing.assert_array_equal(read(entry(tmp_path, "a.sigmf-meta")).values, values)
    second = read(entry(tmp_path, "a.sigmf-meta", capture=1))
    np.testing.assert_array_equal(second.values, values[2000:])


@pytest.mark.parametrize(
    "header, trailing, words",
    [
        (-8, 0, "core:header_bytes is -8, expected a whole number from 0"),
        ("8", 0, "core:header_bytes is '8', expected a whole number from 0"),
        (0, 1.5, "core:trailing_bytes is 1.5, expected a whole number from 0"),
        (10, 10**6, "1000000 trailing bytes"),
    ],
)
def test_impossible_counts_of_bytes_in_sigmf_are_refused(tmp_path, header, trailing, words):
    pytest.importorskip("sigmf")
    captures = [{"sample_start": 0, "header_bytes": header}]
    sigmf_file(tmp_path, wave(), captures, **{"core:trailing_bytes": trailing})
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        read(entry(tmp_path, "a.sigmf-meta"))
    assert "a.sigmf-meta" in str(caught.value)


def test_the_record_overrules_a_wrong_header_only_where_it_says_so(tmp_path):
    wavfile.write(tmp_path / "a.wav", 8000, wave().real.astype(np.int16))
    with pytest.raises(InputError, match="wrong rate, record 12000 Hz, file 8000 Hz"):
        read(entry(tmp_path, "a.wav", "real"))
    assert read(entry(tmp_path, "a.wav", "real", trust="record")).rate_hz == RATE


def test_pairs_that_are_read_as_one_real_channel_are_refused(tmp_path):
    np.save(tmp_path / "a.npy", pairs(wave()).astype(np.int16))
    with pytest.raises(InputError, match="mirrored about a quarter of the rate"):
        read(entry(tmp_path, "a.npy", "real"))
    for real in (wave().real, np.random.default_rng(0).standard_normal(5000)):
        np.save(tmp_path / "a.npy", real)
        assert len(read(entry(tmp_path, "a.npy", "real")).values) == len(real)


@pytest.mark.parametrize("hertz, top", [(20.0, 20000), (5.0, 300), (200.0, 32767), (97.3, 30000)])
def test_a_clean_tone_is_not_clipped_and_a_cut_one_is(hertz, top):
    tone = top * np.sin(2 * np.pi * hertz * np.arange(44100) / 44100)
    whole = np.round(tone)
    cut = np.round(np.clip(tone, -0.9 * top, 0.9 * top))
    assert not clipped(whole).any() and not clipped(whole + 1j * whole).any()
    # A cut sine spends as long at its tops as it does beyond 0.9 of its amplitude.
    for found in (clipped(cut), clipped(whole + 1j * cut)):
        assert found.mean() == pytest.approx(1 - 2 / np.pi * np.arcsin(0.9), rel=0.1)
        assert (abs(cut[found]) == np.round(0.9 * top)).all()


def test_an_array_of_hdf5_is_named_by_its_path(tmp_path):
    h5py = pytest.importorskip("h5py")
    values = wave()
    pair = np.zeros(len(values), [("real", "<i2"), ("imag", "<i2")])
    pair["real"], pair["imag"] = np.round(values.real), np.round(values.imag)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["sessions/first/frame"] = pair
        file["native"] = values
    for name in ("sessions/first/frame", "/sessions/first/frame", "sessions.first.frame"):
        np.testing.assert_allclose(
            read(entry(tmp_path, "a.h5", variable=name)).values, values, atol=0.8
        )
    np.testing.assert_array_equal(read(entry(tmp_path, "a.h5", variable="native")).values, values)
    with pytest.raises(
        InputError,
        match=r"variables \['native', 'sessions.first.frame'\], expected the record to name",
    ):
        read(entry(tmp_path, "a.h5"))
    (tmp_path / "b.hdf5").write_bytes(b"\x89HDF\r\n\x1a\nnothing")
    with pytest.raises(InputError, match=r"b.hdf5: not a readable .hdf5 file"):
        read(entry(tmp_path, "b.hdf5"))


@pytest.mark.parametrize("points", [1, 4])
def test_frames_of_sweeps_are_refused_and_their_sweeps_along_one_axis_are_read(tmp_path, points):
    h5py = pytest.importorskip("h5py")
    sweeps = np.repeat(wave(3456)[:, None], points, axis=1)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["frames"] = sweeps.reshape(27, 128, points)
        file["sweeps"] = sweeps
    with pytest.raises(
        InputError, match=rf"array complex128 \(27, 128, {points}\), frames of sweeps"
    ):
        read(entry(tmp_path, "a.h5", variable="frames", columns=[0]))
    found = read(entry(tmp_path, "a.h5", variable="sweeps", columns=[0]))
    np.testing.assert_array_equal(found.values, sweeps[:, 0])


def chirps_of(count: int = 200, samples: int = 32) -> np.ndarray:
    """Chirps (count, samples) complex of a moving target and of a wall.

    The target moves by 0.1 cycles from chirp to chirp.
    """
    fast = np.arange(samples) / samples
    slow = np.arange(count)[:, None]
    noise = np.random.default_rng(5).standard_normal((2, count, samples))
    wall = 300 * np.exp(2j * np.pi * 3.2 * fast)
    return 1000 * np.exp(2j * np.pi * (7.3 * fast + 0.1 * slow)) + wall + noise[0] + 1j * noise[1]


@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize("parts", [1, 2])
def test_a_text_matrix_with_a_chirp_a_row_is_read_and_recognised(tmp_path, timed, parts):
    chirps = chirps_of()
    every_s = 0.002
    rows = np.concatenate([chirps.real, chirps.imag][:parts], axis=1)
    if timed:
        rows = np.column_stack([rows, 1.7e9 + every_s * np.arange(len(rows))])
    np.savetxt(tmp_path / "a.txt", rows, fmt="%.6f")
    rate = {"rate_hz": None if timed else 1 / every_s}
    found = read(entry(tmp_path, "a.txt", chirps={"samples": 32}, **rate))
    assert len(found.values) == len(chirps) and found.rate_hz == pytest.approx(
        1 / every_s, rel=1e-3
    )
    turns = np.angle(found.values[1:] / found.values[:-1]) / (2 * np.pi)
    # A beat note of a rising chirp at positive frequency is conjugated, so that positive Doppler
    # approaches.
    assert abs(np.median(turns)) == pytest.approx(0.1, abs=0.01)
    best = inspect_recording(tmp_path / "a.txt", 24e9, None if timed else 1 / every_s)
    assert best.readings[0].keys == {"channel": "complex", "chirps": {"samples": 32}}
    assert best.rate_hz == pytest.approx(1 / every_s, rel=1e-3)
    with pytest.raises(InputError, match="expected the 20 samples of a chirp, or twice as many"):
        read(entry(tmp_path, "a.txt", chirps={"samples": 20}, **rate))


def test_two_columns_that_nearly_repeat_each_other_are_no_pair(tmp_path):
    rng = np.random.default_rng(7)
    time = np.arange(48000) / 48000
    beat = np.sign(np.sin(2 * np.pi * 400 * time)) * (1 + 0.1 * np.sin(2 * np.pi * 3 * time))
    other = beat + 0.27 * np.convolve(
        rng.standard_normal(len(time)), np.ones(8) / 8**0.5, mode="same"
    )
    assert np.corrcoef(beat, other)[0, 1] == pytest.approx(0.965, abs=0.01)
    wavfile.write(
        tmp_path / "a.wav", 48000, np.stack([8000 * beat, 8000 * other], axis=1).astype(np.int16)
    )
    with pytest.raises(
        InputError,
        match=r"a.wav: two columns that nearly repeat each other \(squared correlation 0.9",
    ):
        read(entry(tmp_path, "a.wav", rate_hz=None))
    assert len(read(entry(tmp_path, "a.wav", "real", rate_hz=None, columns=[0])).values) == len(
        time
    )
    # A target that moves by a small part of a wavelength draws nearly a line, too, but its noise
    # does not.
    breath = np.exp(0.3j * np.sin(2 * np.pi * 0.3 * time) + 0.8j)
    noise = rng.standard_normal((2, len(time)))
    small = 20000 * breath + 20 * (noise[0] + 1j * noise[1])
    wavfile.write(
        tmp_path / "b.wav", 48000, np.stack([small.real, small.imag], axis=1).astype(np.int16)
    )
    assert len(read(entry(tmp_path, "b.wav", rate_hz=None)).values) == len(time)


def test_eight_columns_offer_the_pairs_of_four_real_and_four_imaginary_ones(tmp_path):
    values = wave(3000)
    gains = [1.0, 10.0, 100.0, 1000.0]
    columns = [gain * part for part in (values.real, values.imag) for gain in gains]
    np.savetxt(tmp_path / "a.txt", np.stack(columns, axis=1), fmt="%.3f", delimiter="\t")
    found = inspect_recording(tmp_path / "a.txt", 24e9, RATE).readings
    offered = [seen.keys["columns"] for seen in found if seen.keys["channel"] == "complex"]
    assert {(0, 4), (1, 5), (2, 6), (3, 7)} <= {tuple(pair) for pair in offered[:4]}


def test_compressed_sound_is_refused_with_what_to_do(tmp_path):
    (tmp_path / "a.mp3").write_bytes(b"ID3")
    words = (
        r"a.mp3: .mp3 keeps what ears hear and drops faint lines of a radar, expected the recording"
        r" as it was made"
    )
    with pytest.raises(InputError, match=words):
        read(entry(tmp_path, "a.mp3"))
    with pytest.raises(InputError, match=words):
        inspect_recording(tmp_path / "a.mp3")


def test_lost_packets_are_found_and_zeros_of_a_quiet_channel_are_not(tmp_path):
    values = np.round(wave().real)
    gaps = values.copy()
    gaps[1000:1200] = 0
    gaps[3000:3010] = 0
    np.testing.assert_array_equal(np.flatnonzero(lost(gaps)), np.arange(1000, 1200))
    assert (
        lost(gaps + 0j)[1000:1200].all()
        and not lost(values).any()
        and not lost(np.zeros(100)).any()
    )
    # A window of which samples are lost is left out, and the others stay.
    np.save(tmp_path / "a.npy", np.tile(values, 4))
    whole = read(entry(tmp_path, "a.npy", "real"))
    twin = radars()["cw_24ghz"]
    torn = whole.values.copy()
    torn[5000:5300] = 0
    found = looks(entry(tmp_path, "a.npy", "real"), twin, Baseband(torn, RATE))
    assert np.flatnonzero(found.lost).tolist() == [1] and len(found.intervals) == 5
    quiet = np.round(1.4 * np.sin(2 * np.pi * np.arange(6000) / 500))
    assert not lost(quiet).any()


READ_AS = {
    "inter_cplx": "say `layout`",
    "inter_real": "mirrored about a quarter of the rate",
    "sig_freq": "a capture at",
    "sig_two": "a capture at",
    "sig_start": None,
    "tone_44100_i2": None,
    "e9": None,
    "N3": None,
    "N10": None,
    "dca_iqiq": "layout 'dca2'",
    "dca_iiqq": "layout 'dca2'",
    "steady_10khz_and_car": None,
}


@pytest.mark.skipif(not FAULTS.is_dir(), reason="no real inputs: the folder of faults is not here")
def test_every_file_of_the_folder_of_faults_is_read_rightly_or_refused():
    found = {path.stem: path for path in FAULTS.glob("*.yaml")}
    assert set(found) == set(READ_AS)
    for name, words in READ_AS.items():
        if words is None:
            values = read(read_record(found[name])).values
            file = FAULTS / yaml.safe_load(found[name].read_text())["file"]
            if name == "sig_start":
                assert len(values) == file.with_suffix(".sigmf-data").stat().st_size // 8 - 18000
        else:
            with pytest.raises(InputError, match=words):
                read(read_record(found[name]))


@pytest.mark.parametrize(
    "chunk", [b"", b"fmt " + struct.pack("<IHHIIHH", 16, 1, 1, 800, 1600, 2, 16)]
)
def test_a_sound_file_without_format_or_samples_is_refused(chunk, tmp_path):
    path = tmp_path / "a.wav"
    path.write_bytes(b"RIFF" + struct.pack("<I", 4 + len(chunk)) + b"WAVE" + chunk)
    with pytest.raises(
        InputError, match=r"a\.wav: a \.wav file without a format or without samples"
    ):
        read(Record(file=path, carrier_hz=24e9, channel="real"))
