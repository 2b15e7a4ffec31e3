"""The download keeps only what matches; pictures and page show what the tables hold; a recording becomes samples."""

import hashlib

import numpy as np
import pytest
from PIL import Image
from scipy.io import wavfile

from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.recordings import download, read_record
from lowalt.recordings.library import Library
from lowalt.recordings.samples import spectra, write
from lowalt.recordings.sets import halves
from lowalt.report import measured
from lowalt.report.sections.measured import ABLATION, ACCURACY, DISTANCES, FIGURES, RECOGNITION
from lowalt.shards import ShardSet, faults


def test_the_download_tries_every_address_and_goes_on(tmp_path, capsys):
    here, gone = tmp_path / "here", tmp_path / "gone"
    here.mkdir()
    (here / "a b.wav").write_bytes(b"sound")
    sums = {name: hashlib.sha256(text).hexdigest() for name, text in (("a b.wav", b"sound"), ("c.wav", b"other"))}
    lines = [f'  - addresses: ["{gone.as_uri()}", "{here.as_uri()}"]', "    files:"]
    lines += [f'      "{name}": {digest}' for name, digest in sums.items()]
    (tmp_path / "sources.yaml").write_text("set:\n" + "\n".join(lines) + "\n")
    arguments = ["--out", str(tmp_path / "out"), "--sources", str(tmp_path / "sources.yaml")]
    with pytest.raises(InputError, match="1 of 2 files could not be fetched"):
        download.main(arguments)
    assert (tmp_path / "out/set/a b.wav").read_bytes() == b"sound"
    assert "set/c.wav" in capsys.readouterr().err
    (here / "c.wav").write_bytes(b"changed")
    with pytest.raises(InputError, match="1 of 2"):
        download.main(arguments)
    assert "SHA-256 is" in capsys.readouterr().err
    assert not (tmp_path / "out/set/c.wav").exists()


def test_every_recording_of_the_split_has_an_address_and_a_checksum():
    known = download.addresses(load_yaml(download.SOURCES))
    split = halves("config/measured/split.yaml")
    named = {f"{name}/{file}" for name, block in split.items() for half in block.values() for file in half}
    assert named == set(known) - {"vehicle_24ghz/LICENSE"}
    for places, pinned in known.values():
        assert len(pinned) == 64 and int(pinned, 16) and all(place.startswith("https://") for place in places)


def test_pictures_and_page_show_what_was_computed(tmp_path):
    level = np.full((8, 5), -40.0, np.float32)
    level[3] = 0.0
    times, speeds = np.arange(5.0), np.linspace(-2, 2, 8)
    np.savez(
        tmp_path / "pair-bird.npz", caption=np.array("a bird"), times_s=times, speeds_mps=speeds, measured=level,
        simulated=level, before=level,
    )  # fmt: skip
    rows = {"label": "Bird", "pair": "bird", "figure": "beat_hz", "unit": "Hz", "measured": "2.31", "class": "balanced"}
    for name, columns in {
        "figures": FIGURES, "distances": DISTANCES, "recognition": RECOGNITION, "accuracy": ACCURACY,
    }.items():  # fmt: skip
        write_csv(tmp_path / f"measured-{name}.csv", columns, [[rows.get(column, "7") for column in columns]])
    arguments = ["--pairs", str(tmp_path), "--tables", str(tmp_path), "--page", str(tmp_path / "page.html")]
    measured.main(arguments)
    page = (tmp_path / "page.html").read_text()
    assert "Held against measurement" in page and "2.31" in page and page.count("data:image/png") == 1
    answered = {"seed": "mean", "set": "birds", "label": "Bird"}
    write_csv(tmp_path / "measured-recognition.csv", RECOGNITION, [
        [{**answered, "file": name, "right_percent": right}.get(column, "7") for column in RECOGNITION]
        for name, right in (("good.csv", "96"), ("bad.csv", "12"))
    ])  # fmt: skip
    (tmp_path / "spectra-birds-bad.csv.png").write_bytes((tmp_path / "measured-bird.png").read_bytes())
    measured.main(arguments)
    page = (tmp_path / "page.html").read_text()
    assert page.index("<td>bad.csv") < page.index("<td>good.csv") and "spectra of bad.csv" in page
    first = (tmp_path / "measured-bird.png").read_bytes()
    assert Image.open(tmp_path / "measured-overview.png").width > 200
    measured.main(arguments)
    assert (tmp_path / "measured-bird.png").read_bytes() == first
    assert "What each randomisation adds" not in page
    cells = {"change": "antenna beam", "difference_percent": "-8.7539"}
    write_csv(tmp_path / "measured-ablation.csv", ABLATION, [[cells.get(column, "7") for column in ABLATION]])
    measured.main(arguments)
    page = (tmp_path / "page.html").read_text()
    assert "What each randomisation adds" in page and "antenna beam" in page and "-8.7539" in page
    for name in ("pair-bird.npz", "spectra-birds-bad.csv.png"):
        (tmp_path / name).unlink()
    (tmp_path / "measured-bird.png").unlink()
    measured.main(arguments)
    assert (
        "2.31" in (tmp_path / "page.html").read_text() and "data:image/png" not in (tmp_path / "page.html").read_text()
    )
    (tmp_path / "measured-figures.csv").unlink()
    with pytest.raises(InputError, match=r"measured-figures\.csv"):
        measured.main(arguments)


def test_a_recording_becomes_signals_spectra_tiles_and_a_shard_of_its_own(tmp_path):
    rate = 48000
    time = np.arange(rate) / rate
    # 10 m/s away from a radar at 24 GHz, and a little noise.
    sound = 0.5 * np.cos(2 * np.pi * 1601.0 * time) + 1e-3 * np.random.default_rng(0).standard_normal(rate)
    wavfile.write(tmp_path / "drive.wav", rate, sound.astype(np.float32))
    (tmp_path / "drive.yaml").write_text(
        "file: drive.wav\ncarrier_hz: 24.0e+9\nchannel: real\nlabel: Vehicle\nsource: made here\nlicence: MIT\n"
    )
    record, twin = read_record(tmp_path / "drive.yaml"), Library.read("config/measured/twins.yaml").twins["cw_24ghz"]
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
    assert entry["fold"] == "test" and entry["geometry"]["A"]["range_m"] is None and entry["motion"]["x_m"] is None
    quiet = tmp_path / "noise.yaml"
    quiet.write_text((tmp_path / "drive.yaml").read_text().replace("channel: real", "channel: complex"))
    with pytest.raises(InputError, match="expected one complex or two"):
        write(read_record(quiet), replace_channel(twin), images, tmp_path / "none")
    assert not (tmp_path / "none").exists()


def replace_channel(twin):
    """The twin with a complex channel."""
    from dataclasses import replace

    return replace(twin, channel="complex", sampling="bare")
