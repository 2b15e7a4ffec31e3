"""Full outputs, too little memory and a killed starter end a process, with one sentence where it can
still speak.
"""

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from lowalt.config.command import error_sentence
from lowalt.files.errors import SpaceError
from lowalt.files.processes import lives
from lowalt.machine import memory
from lowalt.machine.run_pipe import PIPE

ROOT = Path(__file__).parents[1]
BUFFERED = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}


@pytest.mark.parametrize(
    "words",
    [
        ["lowalt", "--help"],
        ["lowalt", "sample", "--help"],
        ["lowalt.motion", "--help"],
    ],
    ids=" ".join,
)
def test_a_full_output_is_said_in_one_sentence(words):
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run(
            [sys.executable, "-m", *words],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            env=BUFFERED,
            cwd=ROOT,
        )
    expected = "error: standard output: No space left on device, expected room to write\n"
    assert (ended.returncode, ended.stderr) == (2, expected)


def test_a_full_folder_of_temporary_files_is_named_and_not_the_recording(tmp_path):
    savemat(tmp_path / "a.mat", {"samples": np.ones((5000, 2))}, do_compression=True)
    largest = 2 * (tmp_path / "a.mat").stat().st_size
    ended = subprocess.run(
        [sys.executable, "-m", "lowalt", "recording", "inspect", str(tmp_path / "a.mat")],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "TMPDIR": str(tmp_path)},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest)),
    )
    assert ended.returncode == 2
    assert f"no room for its arrays in {tmp_path}, expected another TMPDIR" in ended.stderr


def test_a_command_with_too_little_memory_is_refused_before_it_would_hang(tmp_path):
    limit = 250_000_000
    ended = subprocess.run(
        [sys.executable, "-m", "lowalt", "sample", "Crow", "0", "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=60,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
    )
    assert ended.returncode == 2 and not ended.stdout and ended.stderr.count("\n") == 1
    assert ended.stderr.startswith(
        "error: memory: this process may take 250 MB (ulimit -v), expected at least"
    )


GROUPS = {
    "version 2": ("0::/a/b\n", {"a/memory.max": "250000000", "a/b/memory.max": "max"}),
    "version 2, as the root of a container": ("0::/\n", {"memory.max": "250000000"}),
    "version 1": (
        "5:cpu,cpuacct:/c\n4:memory:/a\n0::/\n",
        {"memory/a/memory.limit_in_bytes": "250000000", "c/memory.max": "1"},
    ),
}


@pytest.mark.parametrize("name", GROUPS)
def test_the_least_limit_of_the_control_groups_counts(name, tmp_path):
    lines, limits = GROUPS[name]
    (tmp_path / "proc/self").mkdir(parents=True)
    (tmp_path / "proc/self/cgroup").write_text(lines)
    memory.refuse_little(tmp_path)
    for file, limit in limits.items():
        path = tmp_path / "sys/fs/cgroup" / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{limit}\n")
    with pytest.raises(
        SpaceError, match=r"control group .* may hold 250 MB, expected at least 400"
    ):
        memory.refuse_little(tmp_path)
    for path in (tmp_path / "sys/fs/cgroup").rglob("memory.*"):
        path.write_text("9223372036854771712\n")
    memory.refuse_little(tmp_path)


def test_lack_of_memory_is_one_sentence():
    said = error_sentence(MemoryError("Unable to allocate 9 GiB"))
    assert (
        said
        == "memory: not enough (Unable to allocate 9 GiB), expected more of it, or a smaller input"
    )


JOB = (
    "import time\n"
    "from lowalt.machine.run_pipe import end_with_starter\n"
    "end_with_starter()\n"
    "print('begun', flush=True)\n"
    "time.sleep(60)\n"
)
STARTER = (
    "import subprocess, sys, time\n"
    "from lowalt.machine.run_pipe import hold_pipe\n"
    "pipe = hold_pipe()\n"
    "job = subprocess.Popen([sys.executable, '-c', {job!r}], pass_fds=[pipe] * {handed})\n"
    "print(job.pid, flush=True)\n"
    "time.sleep(60)\n"
)


def started(job: str, handed: bool) -> subprocess.Popen:
    """A process that holds a pipe and starts a job, to which it may hand the pipe."""
    return subprocess.Popen(
        [sys.executable, "-c", STARTER.format(job=job, handed=int(handed))],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT / "src"), PIPE: ""},
    )


def left_by(starter: subprocess.Popen, processes: list[int], wait_s: float) -> list[int]:
    """Kill a starter; return which of the processes live on after a while, and kill them."""
    assert all(map(lives, processes))
    starter.send_signal(signal.SIGKILL)
    starter.wait()
    stop = time.monotonic() + wait_s
    while any(map(lives, processes)) and time.monotonic() < stop:
        time.sleep(0.02)
    still = [process for process in processes if lives(process)]
    for process in still:
        os.kill(process, signal.SIGKILL)
    return still


@pytest.mark.parametrize("handed", [True, False])
def test_a_process_ends_with_its_starter_where_it_has_its_pipe(handed):
    starter = started(JOB, handed)
    said = {starter.stdout.readline().strip() for _ in range(2)}
    (job,) = map(int, said - {"begun"})
    assert left_by(starter, [job], 10 if handed else 0.3) == ([] if handed else [job])


WORKERS = """
import os, time
from lowalt.machine.run_pipe import end_with_starter
from lowalt.machine.side_by_side import together

def work():
    # One write, which that of the other worker cannot part.
    os.write(1, b"%d\\n" % os.getpid())
    time.sleep(60)

end_with_starter()
together([work, work], 2)
"""


def test_workers_of_a_job_end_with_the_job_s_starter():
    starter = started(WORKERS, True)
    processes = [int(starter.stdout.readline()) for _ in range(3)]
    assert left_by(starter, processes, 10) == []
