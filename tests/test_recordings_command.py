"""`python -m lowalt.recordings recognise`: radars side by side, and the order of the table's rows."""

from types import SimpleNamespace

import pytest

from lowalt.recordings import __main__ as command
from lowalt.recordings import reality


@pytest.mark.parametrize(("given", "jobs"), [(["--jobs", "1"], 1), (["--jobs", "2"], 2)])
def test_the_last_radar_begins_first_and_rows_keep_the_library_s_order(tmp_path, monkeypatch, given, jobs):
    begun, tables = [], {}

    def together(calls, at_a_time, start):
        begun.append((at_a_time, start))
        return [call() for call in calls]

    def radar(name, found, library, block, models, out, reuse):
        begun.append(name)
        return [{"radar": name, "part": part, "seen": found, "reuse": reuse} for part in (1, 2)]

    library = SimpleNamespace(twins=dict.fromkeys(("first", "second", "third")))
    kept = [SimpleNamespace(half="test"), SimpleNamespace(half="tuning")]
    monkeypatch.setattr(command, "together", together)
    monkeypatch.setattr(command, "Library", SimpleNamespace(read=lambda _: library))
    monkeypatch.setattr(command, "settings", lambda _: {"seed": 5})
    monkeypatch.setattr(command, "_found", lambda *_: kept)
    monkeypatch.setattr(command.samples, "write_table", lambda path, _, rows: tables.update({path.name: rows}))
    monkeypatch.setattr(reality, "radar", radar)
    monkeypatch.setattr(reality, "accuracy", lambda rows, seed: [len(rows), seed])
    line = ["--inputs", str(tmp_path), "--out", str(tmp_path), "--models", str(tmp_path), "--halves", "test", *given]
    command.recognise(line)
    assert begun == [(jobs, "spawn"), "third", "second", "first"]
    rows = tables["measured-recognition.csv"]
    assert [(row["radar"], row["part"]) for row in rows] == [(name, part) for name in library.twins for part in (1, 2)]
    assert all(row["seen"] == kept[:1] and row["reuse"] is False for row in rows)
    assert tables["measured-accuracy.csv"] == [6, 5]
