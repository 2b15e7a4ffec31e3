"""The download rule: pinned checksums, nothing kept that does not match, on file:// addresses."""

import hashlib

import pytest

from lowalt.files.errors import InputError
from lowalt.targets import download
from real_inputs import FOLDER, needs_inputs


@pytest.fixture
def served(tmp_path, monkeypatch):
    """A folder of subjects with two files, and their checksums pinned."""
    folder = tmp_path / "subjects" / "02"
    folder.mkdir(parents=True)
    sums = {}
    for name, text in (("02.asf", b"skeleton"), ("02_01.amc", b"motion")):
        (folder / name).write_bytes(text)
        sums[f"02/{name}"] = hashlib.sha256(text).hexdigest()
    monkeypatch.setattr(download, "SHA256", sums)
    return folder.parent.as_uri()


def test_files_arrive_once_and_again_where_they_were_changed(served, tmp_path, capsys):
    arguments = ["--out", str(tmp_path / "inputs"), "--base", served]
    download.main(arguments)
    assert (tmp_path / "inputs/cmu/02/02_01.amc").read_bytes() == b"motion"
    download.main([*arguments, "02/02.asf"])
    (tmp_path / "inputs/cmu/02/02.asf").write_bytes(b"changed")
    download.main([*arguments, "02/02.asf"])
    told = [
        "02/02.asf fetched",
        "02/02_01.amc fetched",
        "02/02.asf already there",
        "02/02.asf fetched",
        "",
    ]
    assert capsys.readouterr().out.split("\n") == told
    assert (tmp_path / "inputs/cmu/02/02.asf").read_bytes() == b"skeleton"


@pytest.mark.parametrize(
    ("name", "base", "message"),
    [
        ("99/99.asf", "subjects", r"99/99.asf: no pinned checksum"),
        ("02/02.asf", "nowhere", r"nowhere/02/02.asf: download failed"),
        (
            "02/02_01.amc",
            "subjects",
            r"02/02_01.amc: SHA-256 is \w{64}, expected \w{64}; nothing was kept",
        ),
    ],
)
def test_unknown_missing_and_wrong_files_are_named_and_leave_nothing(
    name, base, message, served, tmp_path
):
    (tmp_path / "subjects/02/02_01.amc").write_bytes(b"another motion")
    with pytest.raises(InputError, match=message):
        download.fetch(name, tmp_path / "inputs", served.replace("subjects", base))
    assert not any(path.is_file() for path in (tmp_path / "inputs").rglob("*"))


def test_line_ends_do_not_matter_and_one_bad_file_does_not_stop_the_others(
    served, tmp_path, monkeypatch, capsys
):
    (tmp_path / "subjects/02/02.asf").write_bytes(b"two\r\nlines\r\n")
    pinned = {
        "02/02_02.amc": "0" * 64,
        **download.SHA256,
        "02/02.asf": hashlib.sha256(b"two\nlines\n").hexdigest(),
    }
    monkeypatch.setattr(download, "SHA256", pinned)
    with pytest.raises(InputError, match="1 of 3 files could not be fetched"):
        download.main(["--out", str(tmp_path / "inputs"), "--base", served])
    out, err = capsys.readouterr()
    assert "02_02.amc: download failed" in err and out.count("fetched") == 2
    assert (tmp_path / "inputs/cmu/02/02.asf").read_bytes() == b"two\r\nlines\r\n"


def test_only_the_pinned_bytes_of_a_file_count(served, tmp_path, monkeypatch):
    monkeypatch.setattr(download, "PINNED_BYTES", {"02/02_01.amc": 6})
    (tmp_path / "subjects/02/02_01.amc").write_bytes(b"motion and its end")
    assert download.fetch("02/02_01.amc", tmp_path, served)
    (tmp_path / "subjects/02/02_01.amc").write_bytes(b"moti")
    (tmp_path / "cmu/02/02_01.amc").unlink()
    with pytest.raises(InputError, match="SHA-256"):
        download.fetch("02/02_01.amc", tmp_path, served)


@needs_inputs
def test_the_recordings_that_the_project_was_made_with_have_the_pinned_checksums():
    assert {
        name: download.checksum(name, FOLDER / "cmu" / name) for name in download.SHA256
    } == download.SHA256
