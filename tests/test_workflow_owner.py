"""Owners of locks (`lowalt.workflow.owner`) in a made /proc, whose fields are numbered as proc(5) numbers them."""

import os
import socket
from pathlib import Path

import pytest

from lowalt.common import processes
from lowalt.common.processes import started
from lowalt.workflow import owner
from lowalt.workflow.owner import TOKEN, Owner

BOOT = "0f1e2d3c-aaaa-bbbb-cccc-0123456789ab"


@pytest.fixture
def proc(tmp_path, monkeypatch):
    """A folder that stands for /proc, without processes; it lists them in the order of their names."""

    class Sorted(type(Path())):
        def glob(self, pattern):
            return iter(sorted(super().glob(pattern)))

    for module in (owner, processes):
        monkeypatch.setattr(module, "Path", lambda path: Sorted(f"{tmp_path}{path}"))
    (tmp_path / "proc/sys/kernel/random").mkdir(parents=True)
    (tmp_path / "proc/sys/kernel/random/boot_id").write_text(f"{BOOT}\n")
    (tmp_path / "proc/self/ns").mkdir(parents=True)
    (tmp_path / "proc/self/ns/pid").symlink_to("pid:[7]")
    return tmp_path / "proc"


def process(proc, pid, state="S", environment=b""):
    """Add a process whose field n holds the number n, except its id, its name and its state."""
    (proc / str(pid)).mkdir()
    (proc / f"{pid}/stat").write_text(f"{pid} (a) b) c) {state} {' '.join(map(str, range(4, 53)))}\n")
    if environment is not None:
        (proc / f"{pid}/environ").write_bytes(environment)


def test_a_process_started_at_the_22nd_field_of_its_state_unless_it_has_ended(proc):
    for pid, state in ((11, "S"), (12, "Z"), (13, "X"), (14, "R")):
        process(proc, pid, state)
    assert [started(pid) for pid in (11, 12, 13, 14, 15)] == [22, None, None, 22, None]


def test_the_token_of_a_run_is_host_first_part_of_the_boot_id_process_and_its_start(proc):
    process(proc, os.getpid())
    assert Owner.current().token == f"{socket.gethostname()}-0f1e2d3c-{os.getpid()}-22"
    assert Owner.current().namespace == "pid:[7]" and Owner.current().boot == BOOT


def test_jobs_left_behind_carry_the_token_live_and_are_not_this_process(proc):
    mark = f"{TOKEN}=one".encode()
    process(proc, 11, environment=None)
    process(proc, 12, environment=b"A=1\0" + mark + b"\0B=2")
    process(proc, 13, "Z", mark)
    process(proc, 14, environment=mark + b"-more")
    process(proc, os.getpid(), environment=mark)
    process(proc, 99999999, environment=mark)
    dead = Owner(2, 3, "host", BOOT, "pid:[7]", "one")
    assert sorted(dead.left_behind()) == [12, 99999999]
    assert Owner(2, 3, "host", "another start", "pid:[7]", "one").left_behind() == []
