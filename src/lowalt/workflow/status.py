"""The state of a run in a file, which `lowalt status` shows in another terminal.

Each run writes .snakemake/status/{process id}.json in its working directory. The file of a finished
run stays until the next run starts there. The command shows all running runs, or else the last one.
"""

import json
import os
import socket
import time
from pathlib import Path

from lowalt.files.atomic import write_file
from lowalt.files.processes import started
from lowalt.machine import progress
from lowalt.workflow.board import Board, span

FOLDER = Path(".snakemake/status")
PLANNED_JOBS = "LOWALT_PLANNED_JOBS"
"""Environment variable: file to which a dry run appends a line of JSON per job that would run."""

FRESH_S = 60.0
"""Age (s) below which a state counts as current.

A run writes every second, but clocks of other machines may differ.
"""


def write(board: Board, state: str, folder: Path = FOLDER) -> None:
    """Write the state of this process's run: "running", "ended", "failed" or "interrupted"."""
    pid = os.getpid()
    kept = {
        "pid": pid,
        "process": started(pid),
        "host": socket.gethostname(),
        "state": state,
        "written": time.time(),
        "board": board.kept(),
    }
    path = folder / f"{pid}.json"
    if not path.exists():
        _sweep(folder)
    write_file(path, json.dumps(kept))


def elsewhere(kept: dict) -> str:
    """Return the name of the machine that a run is on if it is another one, else an empty text."""
    here = socket.gethostname()
    host = kept.get("host", here)
    if host == here:
        return ""
    return host


def alive(kept: dict) -> bool:
    """Return whether the process of a run is alive.

    On another machine it counts as alive if it wrote within the last FRESH_S.
    """
    if elsewhere(kept):
        return kept["state"] == "running" and time.time() - kept["written"] < FRESH_S
    return kept["process"] is not None and started(kept["pid"]) == kept["process"]


def read(folder: Path = FOLDER) -> list[dict]:
    """Return the stored states of all runs of a working directory, oldest first.

    Damaged files are skipped.
    """
    states = []
    for path in folder.glob("*.json"):
        try:
            states.append(json.loads(path.read_text()))
        except (OSError, ValueError):
            continue
    return sorted(states, key=lambda kept: kept["written"])


def _sweep(folder: Path) -> None:
    """Remove the files of runs that have ended."""
    for kept in read(folder):
        if not alive(kept):
            (folder / f"{kept['pid']}.json").unlink(missing_ok=True)


def describe(kept: dict, now: float) -> str:
    """Return the lines of one run."""
    board = Board.read(kept["board"])
    living = alive(kept)
    state = kept["state"]
    if state == "running" and not living:
        state = "stopped unexpectedly, perhaps killed"
    process = f"process {kept['pid']}"
    host = elsewhere(kept)
    if host:
        process += f" of {host}"
    head = f"{process}: {state}, {span(now - kept['written'])} ago"
    moment = now if living else kept["written"]
    lines = [board.line(name, moment, progress.last) for name in board.stages]
    return "\n".join([head, *lines, board.total(moment)])
