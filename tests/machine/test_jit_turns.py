"""Processes that need the same machine code compile it once."""

import os
import subprocess
import sys

import pytest
from filelock import FileLock

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
    path = start(tmp_path, "import slow_kernel; print(slow_kernel.twice._cache.turn.lock_file)").communicate()[0]
    with FileLock(path.strip()):
        run = start(tmp_path, CALL)
        with pytest.raises(subprocess.TimeoutExpired):
            run.wait(4)
    assert run.communicate(timeout=60)[0].strip() == "1"


def test_a_process_goes_on_without_its_turn_after_some_patience(tmp_path):
    (tmp_path / "slow_kernel.py").write_text(KERNEL)
    path = start(tmp_path, "import slow_kernel; print(slow_kernel.twice._cache.turn.lock_file)").communicate()[0]
    hurried = f"import lowalt.machine.jit; lowalt.machine.jit.PATIENCE_S = 0.3; {CALL}"
    with FileLock(path.strip()):
        assert start(tmp_path, hurried).communicate(timeout=60)[0].strip() == "1"
