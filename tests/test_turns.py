"""Processes that need the same machine code compile it once, and none waits for a dead one."""

import os
import signal
import subprocess
import sys
import time

import pytest

from lowalt.machine import turns
from lowalt.machine.turns import Turn

KERNEL = """
from lowalt.machine.jit import PLAIN

@PLAIN
def twice(x):
    total = 0.0
    for k in range(3):
        total += x * k
    return total
"""
CALL = "import slow_kernel; slow_kernel.twice(2.0); print(sum(slow_kernel.twice.stats.cache_misses.values()))"


def start(folder, program):
    environment = os.environ | {"PYTHONPATH": f"{folder}:{os.environ.get('PYTHONPATH', '')}"}
    environment["NUMBA_CACHE_DIR"] = str(folder / "kept")
    return subprocess.Popen([sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, text=True)


def test_processes_that_start_together_compile_a_kernel_once(tmp_path):
    (tmp_path / "slow_kernel.py").write_text(KERNEL)
    runs = [start(tmp_path, CALL) for _ in range(3)]
    assert sorted(int(run.communicate(timeout=120)[0]) for run in runs) == [0, 0, 1]


def test_a_kernel_waits_for_the_process_that_compiles_it(tmp_path):
    (tmp_path / "slow_kernel.py").write_text(KERNEL)
    path = start(tmp_path, "import slow_kernel; print(slow_kernel.twice._cache._turn._path)").communicate()[0].strip()
    turn = Turn(turns.Path(path))
    turn.take()
    run = start(tmp_path, CALL)
    with pytest.raises(subprocess.TimeoutExpired):
        run.wait(4)
    turn.give()
    assert run.communicate(timeout=60)[0].strip() == "1"


def test_the_turn_of_a_killed_process_is_free_and_an_endless_one_is_not_waited_for(tmp_path):
    take = "import sys, time; from pathlib import Path; from lowalt.machine.turns import Turn;"
    take += f"Turn(Path({str(tmp_path / 'a.lock')!r})).take(); print('taken', flush=True); time.sleep(60)"
    holder = start(tmp_path, take)
    assert holder.stdout.readline().strip() == "taken"
    turn, begun = Turn(tmp_path / "a.lock"), time.monotonic()
    turn.take(patience_s=0.3)
    assert 0.3 <= time.monotonic() - begun < 20
    turn.give()
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    begun = time.monotonic()
    turn.take(patience_s=50)
    turn.take(patience_s=50)
    assert time.monotonic() - begun < 20
    turn.give()
    assert turn._descriptor >= 0
    turn.give()
    assert turn._descriptor < 0


def test_the_file_of_a_turn_is_for_every_user(tmp_path):
    before = os.umask(0)
    try:
        Turn(tmp_path / "of/all.lock").take()
    finally:
        os.umask(before)
    assert (tmp_path / "of/all.lock").stat().st_mode & 0o777 == 0o666
