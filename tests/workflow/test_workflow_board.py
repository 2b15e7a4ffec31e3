"""What a run says of itself: lines of stages and the progress of long jobs."""

import io
import json

import pytest

from lowalt.machine import progress
from lowalt.workflow.board import Board, Job, pace, span


def board_of(done: int = 2, running: int = 1) -> Board:
    """Ten jobs of a stage, each 6 s long since second 100, and two jobs of another that have not
    started.
    """
    board = Board({"echo": 10, "tiles": 2}, 100.0)
    for number in range(done + running):
        board.start(number, Job("echo", f"seen/{number}", f"{number}.log", 100.0 + 6 * number))
        if number < done:
            board.finish(number, 106.0 + 6 * number)
    return board


@pytest.mark.parametrize(
    ("done", "now", "parts", "line"),
    [
        (2, 112.0, None, "echo  2/10, 10.0/min, 0:48 left; seen/2"),
        # 2.5 jobs in 15 s, so 7.5 jobs take 45 s.
        (2, 115.0, 50, "echo  2/10, 8.0/min, 0:45 left; seen/2 50/100 steps"),
        # Two of ten jobs are done, but no time has passed, or half a second.
        (2, 100.0, None, "echo  2/10; seen/2"),
        (2, 100.5, None, "echo  2/10, 4.0/s, 0:02 left; seen/2"),
        # A job first compiles: before a tenth of it is done, an estimate would be far too long.
        (0, 160.0, None, "echo  0/10; seen/0"),
        (0, 160.0, 9, "echo  0/10; seen/0 9/100 steps"),
        (0, 160.0, 10, "echo  0/10, 1:39:00 left; seen/0 10/100 steps"),
    ],
)
def test_a_line_has_done_of_all_rate_time_left_and_what_runs_now(done, now, parts, line):
    progress_of = {} if parts is None else {f"{done}.log": progress.Progress(parts, 100, "steps")}
    board = board_of(done)
    assert board.line("echo", now, lambda log, since: progress_of.get(log)) == line
    assert board.total(112.0) == f"all   {done}/12 jobs, 0:12 since the start"
    assert Board.read(json.loads(json.dumps(board.kept()))) == board


def none(log, since):
    """No progress."""


def test_the_last_job_of_a_stage_says_so_and_an_unknown_job_nothing():
    board = Board({"echo": 2}, 0.0)
    assert [board.start(number, Job("echo", "", "", 1.0)) for number in (1, 2)] == [True, False]
    assert board.finish(1, 5.0) is None and board.finish(7, 5.0) is None
    assert board.running() == ["echo"]
    assert board.finish(2, 66.0) == "echo" and board.running() == []
    assert board.line("echo", 99.0, none) == "echo 2/2, done in 1:05"


def test_a_stage_that_no_plan_holds_has_no_jobs_in_all():
    board = Board({}, 100.0)
    board.start(1, Job("echo", "", "", 100.0))
    assert board.line("echo", 100.0, none) == "echo 0/0"
    assert (
        board.finish(1, 100.0) == "echo"
        and board.total(100.0) == "all  1/0 jobs, 0:00 since the start"
    )


def test_failed_jobs_are_counted_and_not_done():
    board = Board({"echo": 2}, 0.0)
    for number in (0, 1):
        board.start(number, Job("echo", "", "", 1.0))
    # A stage whose last job ends is not done where another one failed.
    assert board.finish(0, 5.0, good=False) is None and board.finish(1, 6.0) is None
    assert board.line("echo", 106.0, none).startswith("echo 1/2, 1 failed")


def test_durations_read_as_a_clock_and_rates_are_in_the_unit_that_reads_best():
    assert [span(s) for s in (-1, 59.6, 3599, 3600, 7384)] == [
        "0:00",
        "1:00",
        "59:59",
        "1:00:00",
        "2:03:04",
    ]
    rates = (12.34, 1, 0.5, 1 / 60, 1 / 1800, 1e-5)
    assert [pace(rate) for rate in rates] == [
        "12.3/s",
        "1.0/s",
        "30.0/min",
        "1.0/min",
        "2.0/h",
        "0.0/h",
    ]


def test_progress_is_written_now_and_then_and_its_last_line_read(tmp_path):
    now = [0.0]
    text = io.StringIO()
    report = progress.Reporter(40, "steps", text, lambda: now[0])
    for step in range(40):
        now[0] += 0.5
        report(step + 1)
    assert text.getvalue().splitlines() == [f"progress {step}/40 steps" for step in range(4, 41, 4)]
    log = tmp_path / "train.log"
    log.write_text(
        "x" * 9000 + "\nprogress 8/40 steps\nloss 0.4\n" + text.getvalue()[:40] + "progress 9/4"
    )
    assert progress.last(log) == (8, 40, "steps")
    # A job in a queue has the log of an earlier run until it starts.
    written = log.stat().st_mtime
    assert (
        progress.last(log, written) == (8, 40, "steps") and progress.last(log, written + 2) is None
    )
    log.write_text("no such line")
    assert progress.last(log) is None and progress.last(tmp_path / "none") is None
    assert list(progress.reported("abc", 3, "letters")) == ["a", "b", "c"]
