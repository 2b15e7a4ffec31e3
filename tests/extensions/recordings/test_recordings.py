"""Recordings in: every format gives the same samples.

Bad files are refused by name, and rates and tones come out right.
"""

import struct
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat, wavfile

from lowalt.config.classes import CATEGORIES
from lowalt.config.schema import BROUGHT
from lowalt.extensions.recordings import coherent_intervals, read, read_record, symbol_rate
from lowalt.extensions.recordings.channel import ONE_SIDED_EDGE, analytic
from lowalt.extensions.recordings.record import Record, record
from lowalt.extensions.recordings.twin import CHANNELS, radars
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml

RATE = 8000.0
BASE = {"carrier_hz": 24.0e9, "source": "made here", "licence": "MIT"}


def tone(hertz: float, seconds: float = 0.5, rate: float = RATE) -> np.ndarray:
    """A complex tone (samples,) of unit amplitude.

    A little of another tone is added, so that nothing is constant.
    """
    time = np.arange(round(seconds * rate)) / rate
    return np.exp(2j * np.pi * hertz * time) + 0.1 * np.exp(2j * np.pi * 3.7 * hertz * time)


def entry(folder: Path, file: str, channel: str, **more):
    return record({**BASE, "file": file, "channel": channel, **more}, folder, "here")


def test_every_format_gives_the_same_complex_samples(tmp_path):
    values = tone(200.0)
    pair = np.stack([values.real, values.imag], axis=1)
    savemat(tmp_path / "a.mat", {"Sig": pair, "rate": RATE})
    np.savetxt(tmp_path / "b.csv", pair, delimiter=",", header="i,q", comments="", fmt="%.18g")
    np.save(tmp_path / "c.npy", values)
    wavfile.write(tmp_path / "d.wav", int(RATE), pair)
    for file in ("a.mat", "b.csv", "c.npy", "d.wav"):
        found = read(entry(tmp_path, file, "complex", rate_hz=RATE))
        assert found.rate_hz == RATE
        np.testing.assert_allclose(found.values, values, atol=1e-15)


def test_a_sigmf_recording_brings_its_own_rate(tmp_path):
    sigmf = pytest.importorskip("sigmf")
    values = tone(200.0).astype(np.complex64)
    values.tofile(tmp_path / "e.sigmf-data")
    about = sigmf.SigMFFile(
        data_file=str(tmp_path / "e.sigmf-data"),
        global_info={"core:datatype": "cf32_le", "core:sample_rate": RATE},
    )
    about.add_capture(0)
    about.tofile(str(tmp_path / "e.sigmf-meta"))
    found = read(entry(tmp_path, "e.sigmf-meta", "complex"))
    assert found.rate_hz == RATE
    np.testing.assert_array_equal(found.values, values.astype(np.complex128))


def test_columns_are_chosen_by_name_or_number_and_times_are_checked(tmp_path):
    values = tone(200.0).real
    times = np.arange(len(values)) / RATE
    table = np.stack([times, values], axis=1)
    np.savetxt(tmp_path / "f.csv", table, delimiter=",", header="t,V", comments="", fmt="%.18g")
    named = read(entry(tmp_path, "f.csv", "real", columns=["V"], times="t"))
    np.testing.assert_array_equal(
        named.values, read(entry(tmp_path, "f.csv", "real", columns=[1], times="t")).values
    )
    assert named.rate_hz == pytest.approx(RATE, rel=1e-9)
    with pytest.raises(InputError, match=r"no column 'W', expected one of \['t', 'V'\]"):
        read(entry(tmp_path, "f.csv", "real", columns=["W"], rate_hz=RATE))
    with pytest.raises(InputError, match=r"f.csv: wrong rate, record 9000 Hz, times 8000 Hz"):
        read(entry(tmp_path, "f.csv", "real", columns=["V"], times="t", rate_hz=9000.0))
    table[100:, 0] += 0.01
    np.savetxt(tmp_path / "f.csv", table, delimiter=",", header="t,V", comments="", fmt="%.18g")
    with pytest.raises(InputError, match=r"sample times jump by 0.0101\d* s at sample 100"):
        read(entry(tmp_path, "f.csv", "real", columns=["V"], times="t"))


def test_bad_samples_are_refused_by_name(tmp_path):
    def refused(values, words, channel="complex", **more):
        np.save(tmp_path / "x.npy", values)
        with pytest.raises(InputError, match=words):
            read(entry(tmp_path, "x.npy", channel, rate_hz=RATE, **more))

    values = tone(200.0)
    refused(np.where(np.arange(len(values)) == 7, np.nan, values), r"x.npy: sample 7 is .*nan")
    refused(np.full(100, 0.25), r"x.npy: silent, all 100 samples of channel are 0.25", "real")
    refused(values.real * (1 + 1j), r"I and Q hold the same signal")
    # Positive Doppler approaches; the conjugate is what exchanged columns give.
    refused(
        values.conj(),
        r"channels swapped, the record says the target moves towards",
        moves="towards",
    )
    refused(values, r"channels swapped, the record says the target moves away", moves="away")


def test_the_right_side_passes_and_a_hovering_target_is_not_judged(tmp_path):
    np.save(tmp_path / "y.npy", tone(200.0))
    assert len(read(entry(tmp_path, "y.npy", "complex", rate_hz=RATE, moves="towards")).values)
    np.save(tmp_path / "y.npy", tone(200.0) + 0.9 * tone(-200.0))
    for moves in ("towards", "away"):
        assert len(read(entry(tmp_path, "y.npy", "complex", rate_hz=RATE, moves=moves)).values)


def test_damaged_and_unknown_files_are_refused_by_name(tmp_path):
    (tmp_path / "z.wav").write_bytes(b"RIFF" + struct.pack("<I", 4) + b"nope")
    with pytest.raises(InputError, match=r"z.wav: not a readable .wav file"):
        read(entry(tmp_path, "z.wav", "real"))
    (tmp_path / "z.foo").write_text("1")
    with pytest.raises(InputError, match=r"z.foo: unknown kind of file '.foo'"):
        read(entry(tmp_path, "z.foo", "real"))
    with pytest.raises(InputError, match=r"recording: no file at .*gone.wav"):
        read(entry(tmp_path, "gone.wav", "real"))
    wavfile.write(tmp_path / "s.wav", 44100, np.stack([tone(100.0).real] * 2, 1))
    with pytest.raises(InputError, match=r"s.wav: wrong rate, record 48000 Hz, file 44100 Hz"):
        read(entry(tmp_path, "s.wav", "real", rate_hz=48000.0, columns=[0]))


@pytest.mark.parametrize(
    "change, words",
    [
        ({"channel": "stereo"}, r"here: channel: value 'stereo', expected one of"),
        ({"carrier_hz": -1}, r"carrier_hz: value -1, expected more than 0"),
        ({"colour": 1}, r"unknown key\(s\) \['colour'\]"),
        ({"label": "Fish"}, r"label: value 'Fish', expected one of"),
        ({"columns": [0, 0]}, r"columns: value \[0, 0\], expected every item once"),
        ({"columns": [0, 1]}, r"columns is \[0, 1\], expected one for channel 'real'"),
        ({"moves": "away"}, r"moves is 'away', expected channel 'complex' with it"),
        ({"layout": "iqiq"}, r"layout is 'iqiq', expected channel 'complex'"),
        ({"layout": "qiqi"}, r"here: layout: value 'qiqi', expected one of"),
        ({"dtype": "object"}, r"here: dtype: value 'object', expected one of"),
        ({"trust": "file", "rate_hz": RATE}, r"here: trust: value 'file', expected one of"),
        ({"trust": "record"}, r"expected trust together with rate_hz"),
        ({"empty_s": [3, 1]}, r"here: empty_s: value \[3, 1\], expected the least number first"),
        (
            {"twin": {"distance_m": [10, 1]}},
            r"here: twin.distance_m: value \[10, 1\], expected the least number first",
        ),
    ],
)
def test_a_wrong_record_is_refused_by_key(tmp_path, change, words):
    with pytest.raises(InputError, match=words):
        entry(tmp_path, "x.wav", **{"channel": "real", **change})


def test_the_schema_of_records_has_the_words_of_the_code():
    schema = load_yaml(BROUGHT)["$defs"]["recording"]
    assert set(schema["properties"]) == {field.name for field in fields(Record)}
    assert schema["properties"]["label"]["enum"] == list(CATEGORIES)
    assert schema["properties"]["channel"]["enum"] == list(CHANNELS)


def test_a_record_file_says_where_its_samples_are(tmp_path):
    (tmp_path / "r.yaml").write_text(
        "file: a.wav\ncarrier_hz: 24.0e+9\nchannel: real\nsource: me\nlicence: MIT\nlabel: "
        "Vehicle\n"
    )
    found = read_record(tmp_path / "r.yaml")
    assert (found.file, found.name, found.label) == (tmp_path / "a.wav", "a", "Vehicle")
    assert (found.source, found.licence) == ("me", "MIT")


def test_a_record_needs_three_keys_and_takes_numbers_in_any_writing(tmp_path):
    path = tmp_path / "r.yaml"
    for text in ("3.3e9", "3300000000", "3.3e+9", ".33e10", "+33E8"):
        path.write_text(
            f"file: a.csv\ncarrier_hz: {text}\nchannel: real\nrate_hz: 8e3\ncolumns: [2.0]\n"
        )
        found = read_record(path)
        assert (found.carrier_hz, found.rate_hz) == (3.3e9, 8e3) and repr(found.columns) == "(2,)"
    for text in (".inf", ".nan", "1e400", "3.3 GHz", "'0x10'"):
        path.write_text(f"file: a.csv\ncarrier_hz: {text}\nchannel: real\n")
        with pytest.raises(
            InputError, match=r"r\.yaml: carrier_hz: value .*, expected type number"
        ):
            read_record(path)


def test_the_record_of_a_radar_takes_numbers_in_any_writing_and_is_refused_by_key(tmp_path):
    path = tmp_path / "mine.yaml"
    known = Path("config/measured/radars/uav_3ghz.yaml").read_text()
    path.write_text(known.replace("3.3e+9", "3.3e9"))
    assert radars(tmp_path) == {"mine": radars()["uav_3ghz"]}
    for line, change, words in (
        ("carrier_hz: 3.3e+9", "carrier_hz: .inf", "carrier_hz: value "),
        ("sampling: bare", "sampling: [1]", "twin.sampling: value "),
        ("rate_hz: 5000.1", "", r"missing key\(s\) \['file'\], expected it, or twin"),
        ("simulated_hz: 5000.1", "simulated_hz: 100", "expected at least one sample per value"),
        ("tip: [2.0", "tips: [2.0", r"twin.scenes.UAV.0: unknown key\(s\) \['tips'\]"),
        ("leak_db: [10.0", "leak_db: [1000", "twin.receiver.leak_db"),
    ):
        assert known.count(line) >= 1
        path.write_text(known.replace(line, change, 1))
        with pytest.raises(InputError, match=rf"mine\.yaml: .*{words}") as refused:
            radars(tmp_path)
        assert len(str(refused.value)) <= 400
    path.unlink()
    with pytest.raises(InputError, match="no record of a radar, expected files such as"):
        radars(tmp_path)


@pytest.mark.parametrize("sampling", ["anti_aliased", "bare"])
@pytest.mark.parametrize("rate, symbol_hz", [(8000.0, 1000.0), (5000.1, 1234.5), (44100.0, 3000.0)])
def test_a_slow_tone_keeps_frequency_phase_and_amplitude_at_any_ratio(sampling, rate, symbol_hz):
    time = np.arange(round(0.4 * rate)) / rate
    found = symbol_rate(np.exp(2j * np.pi * 101.0 * time), rate, 1 / symbol_hz, sampling)
    wanted = np.exp(2j * np.pi * 101.0 * np.arange(len(found)) / symbol_hz)
    middle = slice(60, len(found) - 60)
    np.testing.assert_allclose(found[middle], wanted[middle], atol=1e-4)


def test_a_fast_tone_folds_bare_and_vanishes_anti_aliased():
    time = np.arange(8000) / 8000.0
    fast = np.exp(2j * np.pi * 1300.0 * time)
    bare = symbol_rate(fast, 8000.0, 1e-3, "bare")
    wanted = np.exp(2j * np.pi * 300.0 * np.arange(len(bare)) * 1e-3)
    np.testing.assert_allclose(bare, wanted, atol=1e-9)
    assert abs(symbol_rate(fast, 8000.0, 1e-3, "anti_aliased")[60:-60]).max() < 1e-3


PASSED = {"anti_aliased": (-0.4, 0.4), "one_sided": (0.0, ONE_SIDED_EDGE), "bare": (-1.0, 1.0)}
"""Band over the symbol rate in which a tone keeps its amplitude; the rest is filtered away, or
folds (bare).
"""
STOPPED = {"anti_aliased": 0.5, "one_sided": 1.0, "bare": np.inf}


@pytest.mark.parametrize("channel", ["real", "complex"])
@pytest.mark.parametrize("sampling", ["anti_aliased", "one_sided", "bare"])
@pytest.mark.parametrize("rate", [2000.0, 2205.0, 8000.0])
def test_tones_across_the_band_keep_their_amplitude_or_vanish(sampling, channel, rate):
    """The gain of tones from 2 Hz on, at a symbol rate of 1000.

    It is at least 99.9 % where tones are kept, and at most 0.1 % where they are not.
    """
    if sampling == "one_sided" and channel == "complex":
        with pytest.raises(InputError, match="one_sided' for a complex channel"):
            symbol_rate(np.ones(100, complex), rate, 1e-3, sampling)
        return
    low, high = PASSED[sampling]
    for hertz in (
        2.0,
        5.0,
        20.0,
        60.0,
        150.0,
        399.0,
        520.0,
        700.0,
        900.0,
        940.0,
        1010.0,
        1300.0,
        1900.0,
        3900.0,
    ):
        for sign in (1, -1) if channel == "complex" else (1,):
            if hertz >= (0.5 if channel == "real" or sampling != "bare" else 0.4) * rate:
                continue
            tone = np.exp(2j * np.pi * sign * hertz * np.arange(int(2 * rate)) / rate)
            found = symbol_rate(tone if channel == "complex" else tone.real, rate, 1e-3, sampling)
            count = np.arange(len(found))[200:-200]
            taper = np.hanning(len(count))
            left = (
                abs(np.sum(taper * found[count] * np.exp(-2e-3j * np.pi * sign * hertz * count)))
                / taper.sum()
            )
            if low <= sign * hertz / 1000 <= high or (sampling == "bare" and hertz < rate / 2):
                assert left == pytest.approx(1, abs=1e-3), (hertz, sign)
            elif hertz / 1000 >= STOPPED[sampling]:
                assert abs(found[count]).max() < 1e-3, (hertz, sign)


def test_one_sided_sampling_shows_the_upper_half_of_its_band_as_negative_frequencies():
    found = symbol_rate(
        np.cos(2 * np.pi * 800.0 * np.arange(8000) / 8000.0), 8000.0, 1e-3, "one_sided"
    )[80:-80]
    spectrum = abs(np.fft.fft(found * np.hanning(len(found))))
    assert np.fft.fftfreq(len(found), 1e-3)[spectrum.argmax()] == pytest.approx(-200.0, abs=2)


def test_the_analytic_signal_loses_the_sign_of_the_doppler_and_nothing_else():
    time = np.arange(4096) / 4096.0
    towards, away = (np.exp(2j * np.pi * sign * 400.0 * time) for sign in (1, -1))
    np.testing.assert_allclose(analytic(towards.real), analytic(away.real), atol=1e-12)
    np.testing.assert_allclose(analytic(towards.real)[200:-200], towards[200:-200], atol=0.02)


def test_intervals_do_not_overlap_and_lose_only_what_stands_still():
    signal = np.arange(1050) * (1 + 2j)
    found = coherent_intervals(signal + 1e6, 400)
    assert found.shape == (2, 400)
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_allclose(found[0], signal[:400] - signal[:400].mean(), atol=1e-9)
    with pytest.raises(InputError, match="short: 399 symbols, shorter than one window of 400"):
        coherent_intervals(signal[:399], 400, name="short")


def test_what_is_slower_than_the_slowest_target_is_gone_and_all_else_keeps_its_level():
    time = np.arange(1200) / 3000
    taper = np.hanning(1200)
    for hertz, wanted in (
        (5.0, -50),
        (20.0, -50),
        (45.0, -50),
        (64.0, 0),
        (80.0, 0),
        (150.0, 0),
        (-64.0, 0),
        (1400.0, 0),
    ):
        for phase in (0.0, 1.0, 2.0):
            tone = np.exp(2j * np.pi * hertz * time + 1j * phase)
            left = coherent_intervals(tone, 1200, slow=64 / 3000)[0] * taper
            level = 20 * np.log10(np.linalg.norm(left) / np.linalg.norm(taper))
            assert level < wanted if wanted else level == pytest.approx(0, abs=0.05), (
                hertz,
                phase,
                level,
            )
    still = coherent_intervals(np.full(1200, 3 + 4j), 1200, slow=64 / 3000)
    assert not still.any()


def test_a_recording_slower_than_the_symbols_is_refused():
    with pytest.raises(InputError, match=r"has less than one per symbol"):
        symbol_rate(np.zeros(10, complex), 500.0, 1e-3, "bare")
