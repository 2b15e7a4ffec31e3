"""Jobs of one machine share no GPU: the driver's tool and the GPUs are made up, the locks and processes are real."""

import os
import stat
import subprocess
import sys
import time

import pytest

from lowalt.files.errors import InputError
from lowalt.recognition import gpus

SHOW = "import os, sys, time; print(os.environ.get('CUDA_VISIBLE_DEVICES')); sys.stdout.flush(); time.sleep({})"


@pytest.fixture
def driver(tmp_path, monkeypatch):
    """A machine with three GPUs, and lock files in a folder of the test's own."""
    tool = tmp_path / "bin/nvidia-smi"
    tool.parent.mkdir()
    tool.write_text("#!/bin/sh\nprintf 'GPU-a\\nGPU-b\\nGPU-c\\n'\n")
    tool.chmod(tool.stat().st_mode | stat.S_IXUSR)
    for name, value in {"PATH": f"{tool.parent}:{os.environ['PATH']}", "TMPDIR": str(tmp_path)}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(gpus.tempfile, "tempdir", None)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    return tmp_path


def job(folder, count, seconds):
    """A job that prints the GPUs it sees, and then uses them for some seconds."""
    (folder / f"show{seconds}.py").write_text(SHOW.format(seconds))
    environment = {**os.environ, "PYTHONPATH": f"{folder}:{os.environ.get('PYTHONPATH', '')}"}
    line = [sys.executable, "-m", "lowalt.recognition.gpus", str(count), f"show{seconds}"]
    return subprocess.Popen(line, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_jobs_at_the_same_time_have_gpus_of_their_own_and_the_next_one_waits(driver):
    one, two = job(driver, 2, 60), job(driver, 1, 60)
    first, second = (process.stdout.readline().strip().split(",") for process in (one, two))
    assert sorted(first + second) == ["GPU-a", "GPU-b", "GPU-c"] and len(first) == 2
    third = job(driver, 2, 0)
    assert "waiting for 2 of 3 GPUs" in third.stderr.readline()
    time.sleep(1.5 * gpus.POLL_S)
    assert third.poll() is None
    one.kill()
    # A killed job's locks are free at once.
    assert third.stdout.readline().strip().split(",") == first
    two.kill()
    assert third.wait() == 0


def test_a_process_keeps_its_gpu_and_an_ended_claim_is_free_again(driver, monkeypatch):
    monkeypatch.setattr(gpus, "_OWN", {})
    other = gpus.claim(gpus.visible(), 1)
    assert list(other) == [0]
    assert gpus.own(gpus.visible()) == 1 and gpus.own(gpus.visible()) == 1
    os.close(other[0])
    last = gpus.claim(gpus.visible(), 2)
    assert list(last) == [0, 2]
    for descriptor in (*last.values(), *gpus._OWN.values()):
        os.close(descriptor)


def test_only_gpus_that_the_scheduler_gave_are_claimed(driver, monkeypatch):
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "2,GPU-a")
    assert gpus.visible() == ["GPU-c", "GPU-a"]
    with pytest.raises(InputError, match="3 GPUs asked for, this machine has 2"):
        gpus.claim(gpus.visible(), 3)
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "7")
    with pytest.raises(InputError, match=r"CUDA_VISIBLE_DEVICES: \['7'\]"):
        gpus.visible()


def test_a_machine_without_gpu_runs_the_module_as_it_is(tmp_path, monkeypatch):
    monkeypatch.setattr(gpus.shutil, "which", lambda name: None)
    assert gpus.visible() == []
    begun = []
    monkeypatch.setattr(gpus.os, "execv", lambda program, line: begun.append(line))
    for wrong in (["train"], ["1"], ["0", "train"], ["one", "train"]):
        with pytest.raises(InputError, match="expected COUNT MODULE"):
            gpus.main(wrong)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    gpus.main(["2", "train", "--fast"])
    assert begun == [[sys.executable, "-m", "train", "--fast"]] and "CUDA_VISIBLE_DEVICES" not in os.environ


def test_all_gpus_may_be_claimed_at_once_by_a_job_of_any_user(driver, monkeypatch):
    before = os.umask(0)
    try:
        held = gpus.claim(gpus.visible(), 3)
    finally:
        os.umask(before)
    assert list(held) == [0, 1, 2]
    locks = sorted(path for path in driver.iterdir() if path.suffix == ".lock")
    assert [(path.name, path.stat().st_mode & 0o777) for path in locks] == [
        (f"lowalt-gpu-{name}.lock", 0o644) for name in ("a", "b", "c", "turn")]  # fmt: skip
    # Two asked for and one free: the one is given back, and the next look is a second later.
    os.close(held.pop(1))
    asked = []

    def sleep(seconds):
        asked.append(seconds)
        os.close(held.pop(2))

    monkeypatch.setattr(gpus.time, "sleep", sleep)
    found = gpus.claim(gpus.visible(), 2)
    assert list(found) == [1, 2] and asked == [1.0]
    for descriptor in (*found.values(), *held.values()):
        os.close(descriptor)


def test_a_driver_that_fails_has_no_gpus(driver):
    (driver / "bin/nvidia-smi").write_text("#!/bin/sh\necho 'no driver'\nexit 9\n")
    assert gpus.visible() == []
