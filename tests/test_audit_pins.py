"""The audit of the pins: what pip-audit finds, that its silence is named, and the table from an index that answers."""

import csv
import http.server
import json
import sys
import threading
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / ".ci"))

import audit_pins

PINS = "# a comment\nnumpy==2.0.1\nscipy==1.0.0\n"
CLEAN = [{"name": "numpy", "version": "2.0.1", "vulns": []}, {"name": "scipy", "version": "1.0.0", "vulns": []}]
BAD = [CLEAN[0], {"name": "scipy", "version": "1.0.0", "vulns": [{"id": "CVE-2023-25399"}]}]
PAGE = {"files": [
    {"filename": "numpy-2.0.1-cp311-cp311-linux_x86_64.whl", "upload-time": "2024-07-22T10:00:00Z"},
    {"filename": "numpy-2.0.1.tar.gz", "upload-time": "2024-07-21T10:00:00Z"},
    {"filename": "numpy-2.10.0.tar.gz", "upload-time": "2026-01-02T10:00:00Z"},
    {"filename": "numpy-2.9.0.tar.gz", "upload-time": "2025-12-01T10:00:00Z"},
    {"filename": "numpy-2.11.0rc1.tar.gz", "upload-time": "2026-02-02T10:00:00Z"},
    {"filename": "numpy-2.12.0.tar.gz", "upload-time": "2026-03-02T10:00:00Z", "yanked": "broken"},
    {"filename": "numpy-of-old.exe"},
]}  # fmt: skip


def says(text, folder):
    """A command in pip-audit's place that prints a text and ignores its arguments."""
    script = folder / "says.py"
    script.write_text(f"import sys\nprint({text!r})\nprint('no route to the data', file=sys.stderr)\nsys.exit(1)\n")
    return [sys.executable, str(script)]


@pytest.fixture
def given(tmp_path):
    (tmp_path / "pins.txt").write_text(PINS)
    return ["--pins", str(tmp_path / "pins.txt"), "--out", str(tmp_path / "pins.csv")]


@pytest.mark.parametrize(("told", "status", "line"), [
    (CLEAN, 0, "2 pins, no known vulnerability"), (BAD, 1, "scipy 1.0.0: CVE-2023-25399"),
])  # fmt: skip
def test_what_pip_audit_finds_decides_the_status(given, tmp_path, capsys, told, status, line):
    assert audit_pins.main(given, says(json.dumps({"dependencies": told}), tmp_path)) == status
    assert capsys.readouterr().out.strip() == line
    assert not (tmp_path / "pins.csv").exists()


@pytest.fixture
def index():
    """An index that knows numpy, as a package index answers."""

    class Page(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            """Answer with the page of numpy, with 404 for all others."""
            self.send_response(200 if self.path == "/simple/numpy/" else 404)
            self.end_headers()
            self.wfile.write(json.dumps(PAGE).encode() if self.path == "/simple/numpy/" else b"")

        def log_message(self, *arguments):
            """Say nothing."""

    with http.server.HTTPServer(("127.0.0.1", 0), Page) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/simple"
        server.shutdown()


@pytest.mark.parametrize("text", ["", json.dumps({"dependencies": CLEAN[:1]})])
def test_without_an_answer_the_table_has_versions_and_the_dates_that_the_index_tells(
    given, tmp_path, capsys, monkeypatch, index, text
):
    monkeypatch.setenv("PIP_INDEX_URL", index)
    monkeypatch.delenv("PIP_CERT", raising=False)
    assert audit_pins.main(given, says(text, tmp_path)) == audit_pins.UNKNOWN
    said = capsys.readouterr().err.strip().splitlines()
    reason = "it answered for 1 of 2 packages" if text else "no route to the data"
    assert said == [f"pip-audit has no answer here ({reason}); {tmp_path}/pins.csv: 2 versions, 1 with dates"]
    with (tmp_path / "pins.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0] == list(audit_pins.COLUMNS)
    assert rows[1:] == [["numpy", "2.0.1", "2024-07-21", "2.10.0", "2026-01-02"], ["scipy", "1.0.0", "", "", ""]]


def test_without_an_index_the_versions_stay(given, tmp_path, monkeypatch):
    monkeypatch.setenv("PIP_INDEX_URL", "http://127.0.0.1:9/simple")
    monkeypatch.delenv("PIP_CERT", raising=False)
    assert audit_pins.main(given, says("", tmp_path)) == audit_pins.UNKNOWN
    lines = (tmp_path / "pins.csv").read_text().splitlines()
    assert lines[1:] == ["numpy,2.0.1,,,", "scipy,1.0.0,,,"]


def test_silence_counts_as_no_answer(monkeypatch):
    monkeypatch.setattr(audit_pins, "PATIENCE_S", 0.1)
    silent = [sys.executable, "-c", "import time; time.sleep(60)"]
    assert audit_pins.vulnerabilities({"numpy": "2.0.1"}, silent) == "it said nothing within 0.1 s"
