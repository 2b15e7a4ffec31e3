"""Calls made side by side: their order, their processes, and what a failing one leaves undone."""

import os
import signal
import time
from functools import partial

import pytest

from lowalt.files.errors import InputError, SpaceError
from lowalt.machine.side_by_side import together


def told(number, wait):
    """Return a number and the process that was asked, after a while (s)."""
    time.sleep(wait)
    return number, os.getpid()


def met(folder, number):
    """Return a number and the process that was asked, once two calls have begun."""
    (folder / str(number)).touch()
    until = time.monotonic() + 30
    while len(list(folder.iterdir())) < 2 and time.monotonic() < until:
        time.sleep(0.01)
    return number, os.getpid()


def marked(path):
    """Leave a file, and take so long that an error is seen before many such calls have begun."""
    path.touch()
    time.sleep(0.05)


def gone():
    os.kill(os.getpid(), signal.SIGKILL)


def refused(path):
    raise InputError(f"{path}: expected something else")


@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_results_keep_the_order_of_the_calls_and_come_from_two_processes_at_a_time(tmp_path, start):
    found = together([partial(met, tmp_path, number) for number in range(4)], 2, start)
    assert [number for number, _ in found] == [0, 1, 2, 3]
    processes = {process for _, process in found}
    assert len(processes) == 2 and os.getpid() not in processes


def test_one_job_stays_in_this_process():
    assert together([partial(told, number, 0) for number in range(3)], 1) == [
        (n, os.getpid()) for n in range(3)
    ]


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_is_that_of_the_call_and_calls_not_begun_are_left_out(jobs, tmp_path):
    late = [partial(marked, tmp_path / str(number)) for number in range(20)]
    with pytest.raises(InputError, match=r"^table\.csv: expected something else$"):
        together([partial(refused, "table.csv"), partial(told, 0, 0.3), *late], jobs)
    assert len(list(tmp_path.iterdir())) < 20


@pytest.mark.parametrize("jobs", [0, -1])
def test_a_number_of_jobs_below_one_is_refused(jobs):
    with pytest.raises(InputError, match=rf"^jobs: {jobs}, expected 1 or more$"):
        together([], jobs)


def test_a_process_that_is_killed_ends_in_one_error():
    with pytest.raises(SpaceError, match="a process was killed before it had its result"):
        together([partial(told, 0, 0), gone, partial(told, 1, 0)], 2)
