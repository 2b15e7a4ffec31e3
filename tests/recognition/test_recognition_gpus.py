"""Jobs of one machine share no GPU: the GPUs are made up, the locks and processes are real."""

import os
import subprocess
import sys
import time

import pytest

from lowalt.recognition import gpus

JOB = """
import sys, time
from lowalt.recognition import gpus

print(gpus.claimed(("GPU-a", "GPU-b")), flush=True)
time.sleep(60)
"""


@pytest.fixture
def locks(tmp_path, monkeypatch):
    """A folder of lock files of the test's own."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(gpus.tempfile, "tempdir", None)
    gpus.claimed.cache_clear()
    yield tmp_path
    gpus.claimed.cache_clear()


def test_jobs_at_the_same_time_have_gpus_of_their_own_and_the_next_one_waits(locks):
    def job():
        return subprocess.Popen(
            [sys.executable, "-c", JOB], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    jobs = [job(), job()]
    assert sorted(process.stdout.readline() for process in jobs) == ["0\n", "1\n"]
    third = job()
    assert "waiting for one of 2 GPUs" in third.stderr.readline()
    time.sleep(1.5 * gpus.POLL_S)
    assert third.poll() is None
    # A killed job's lock is free at once.
    jobs[1].kill()
    assert third.stdout.readline() in ("0\n", "1\n")
    for process in (*jobs, third):
        process.kill()
        process.communicate()


def test_a_process_keeps_its_gpu_and_any_user_s_job_may_take_the_lock_later(locks):
    before = os.umask(0)
    try:
        assert gpus.claimed(("GPU-a", "GPU-b")) == gpus.claimed(("GPU-a", "GPU-b")) == 0
        assert gpus.claimed(("GPU-a", "GPU-b", "GPU-c")) == 1
    finally:
        os.umask(before)
    assert [(path.name, path.stat().st_mode & 0o777) for path in sorted(locks.iterdir())] == [
        (f"lowalt-gpu-{name}.lock", 0o644) for name in "ab"
    ]
