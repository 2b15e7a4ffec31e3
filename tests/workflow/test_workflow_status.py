"""The state of a run, seen from another terminal: running, ended, failed, interrupted, killed, on
another machine.
"""

import json
import logging
import os
import time

from test_workflow_board import board_of
from test_workflow_display import handler_of, record

from lowalt.__main__ import main
from lowalt.workflow import status


def test_the_state_of_a_run_is_seen_from_elsewhere_and_a_killed_one_is_called_so(tmp_path):
    folder = tmp_path / "status"
    folder.mkdir()
    (folder / "1.json").write_text("{damaged")
    status.write(board_of(), "running", folder)
    (kept,) = status.read(folder)
    assert status.alive(kept)
    text = status.describe(kept, kept["written"])
    assert (
        text.startswith(f"process {os.getpid()}: running, 0:00 ago\necho  2/10")
        and "all   2/12 jobs" in text
    )
    dead = kept | {"pid": 2**22 + 1}
    assert "killed" in status.describe(dead, kept["written"])
    # The next run sweeps what dead ones left.
    (folder / f"{dead['pid']}.json").write_text(json.dumps(dead))
    (folder / f"{os.getpid()}.json").unlink()
    status.write(board_of(), "running", folder)
    assert [found["pid"] for found in status.read(folder)] == [os.getpid()]
    # One that ends meanwhile stays to be seen until another run starts.
    (folder / f"{dead['pid']}.json").write_text(json.dumps(dead))
    status.write(board_of(), "running", folder)
    assert {found["pid"] for found in status.read(folder)} == {os.getpid(), dead["pid"]}


def test_a_run_without_a_failed_job_is_told_apart_ended_failed_or_interrupted(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    wrong = record(
        "WorkflowError:\nno room", logging.ERROR, event="error", exception="WorkflowError"
    )
    ctrl_c = record("Terminating processes on user request, this might take some time.")
    for records, state in (([], "ended"), ([wrong], "failed"), ([ctrl_c, wrong], "interrupted")):
        handler = handler_of()
        handler.emit(record("run", event="run_info", stats={"echo": 2, "total": 2}))
        for one in records:
            handler.emit(one)
        handler.close()
        assert status.read()[-1]["state"] == state


def test_a_run_on_another_machine_lives_while_its_file_is_fresh(tmp_path):
    folder = tmp_path / "status"
    folder.mkdir()
    status.write(board_of(), "running", folder)
    (kept,) = status.read(folder)
    there = kept | {"host": "login-2", "pid": 2**22 + 1}
    assert status.alive(there | {"written": time.time() - 55})
    assert not status.alive(there | {"written": time.time() - 60.5})
    assert not status.alive(there | {"state": "ended"})
    assert status.describe(there, kept["written"]).startswith(
        f"process {2**22 + 1} of login-2: running, 0:00 ago"
    )
    unnamed = {key: value for key, value in kept.items() if key != "host"}
    assert (
        status.elsewhere(there) == "login-2"
        and status.elsewhere(kept) == status.elsewhere(unnamed) == ""
    )


def test_a_run_that_ended_says_so_and_its_times_stop_at_its_last_word(tmp_path, monkeypatch):
    folder = tmp_path / "status"
    folder.mkdir()
    status.write(board_of(), "running", folder)
    (kept,) = status.read(folder)
    kept |= {"written": 112.0}
    dead = kept | {"pid": 2**22 + 1}
    head, *rest = status.describe(dead | {"state": "failed"}, 172.0).splitlines()
    assert head == f"process {2**22 + 1}: failed, 1:00 ago"
    assert rest[-1] == "all   2/12 jobs, 0:12 since the start"
    assert status.describe(kept, 172.0).endswith("all   2/12 jobs, 1:12 since the start")
    # An owner whose start nobody could read is not taken for one that lives.
    assert not status.alive(kept | {"process": None, "pid": 2**22 + 1})


def test_the_command_shows_runs_that_live_or_else_the_one_that_ended_last(
    tmp_path, monkeypatch, capsys
):
    folder = tmp_path / "status"
    folder.mkdir()
    status.write(board_of(), "running", folder)
    lives = json.loads((folder / f"{os.getpid()}.json").read_text())
    status_of = []
    monkeypatch.setattr(status, "read", lambda: status_of)
    assert main(["status"]) == 2 and "no run has started here" in capsys.readouterr().err
    for number in (1, 2, 3):
        status_of.append(lives | {"pid": 2**22 + number, "state": "ended"})
    assert main(["status"]) == 0
    assert [
        line for line in capsys.readouterr().out.splitlines() if line.startswith("process")
    ] == [f"process {2**22 + 3}: ended, 0:00 ago"]
    status_of.insert(1, lives)
    assert main(["status"]) == 0
    assert [
        line.partition(":")[0]
        for line in capsys.readouterr().out.splitlines()
        if line.startswith("process")
    ] == [f"process {os.getpid()}"]
