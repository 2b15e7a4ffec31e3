"""What a run says of itself: lines of stages, progress of long jobs, the state in a file."""

import io
import json

import pytest

from lowalt.machine import progress
from lowalt.workflow.board import Board, Job, pace, span


def board_of(done: int = 2, running: int = 1) -> Board:
    """Ten jobs of a stage, each 6 s long since second 100, and two jobs of another that have not started."""
    board = Board({"echo": 10, "tiles": 2}, 100.0)
    for number in range(done + running):
        board.start(number, Job("echo", f"seen/{number}", f"{number}.log", 100.0 + 6 * number))
        if number < done:
            board.finish(number, 106.0 + 6 * number)
    return board


def test_a_line_has_done_of_all_rate_time_left_and_what_runs_now():
    assert board_of().line("echo", 112.0, lambda log, since: None) == "echo  2/10, 10.0/min, 0:48 left; seen/2"
    assert board_of().total(112.0) == "all   2/12 jobs, 0:12 since the start"


def test_progress_of_a_running_job_counts_as_its_part():
    halfway = {"2.log": progress.Progress(30, 60, "models")}.get
    # 2.5 jobs in 15 s, so 7.5 jobs take 45 s.
    assert board_of().line("echo", 115.0, halfway) == "echo  2/10, 8.0/min, 0:45 left; seen/2 30/60 models"
    assert "left" not in board_of(done=0).line("echo", 115.0, lambda log, since: None)


def test_no_time_left_is_named_before_a_tenth_of_a_job_is_done():
    """After 60 s of compiling and 1 % of the steps, an estimate would be of an hour and a half."""
    lines = {}
    for steps in (1, 9, 10, 50):
        progress_of = {"0.log": progress.Progress(steps, 100, "steps")}.get
        lines[steps] = board_of(done=0).line("echo", 160.0, progress_of)
    assert lines[1] == "echo  0/10; seen/0 1/100 steps" and "left" not in lines[9]
    assert lines[10].startswith("echo  0/10, 1:39:00 left; ") and lines[50].startswith("echo  0/10, 19:00 left; ")


def test_the_last_job_of_a_stage_says_so_and_an_unknown_job_nothing():
    board = Board({"echo": 2}, 0.0)
    assert [board.start(number, Job("echo", "", "", 1.0)) for number in (1, 2)] == [True, False]
    assert board.finish(1, 5.0) is None and board.finish(7, 5.0) is None
    assert board.running() == ["echo"]
    assert board.finish(2, 66.0) == "echo" and board.running() == []
    assert board.line("echo", 99.0, lambda log, since: None) == "echo 2/2, done in 1:05"


def test_a_stage_that_no_plan_holds_has_no_jobs_in_all_and_a_first_moment_no_rate():
    board = Board({}, 100.0)

    def none(log, since):
        return None

    board.start(1, Job("echo", "", "", 100.0))
    assert board.line("echo", 100.0, none) == "echo 0/0"
    assert board.finish(1, 100.0) == "echo" and board.total(100.0) == "all  1/0 jobs, 0:00 since the start"
    # Two of ten jobs are done, but no time has passed, or half a second.
    assert board_of().line("echo", 100.0, none) == "echo  2/10; seen/2"
    assert board_of().line("echo", 100.5, none) == "echo  2/10, 4.0/s, 0:02 left; seen/2"


def test_failed_jobs_are_counted_and_not_done():
    board = board_of(done=0, running=2)
    board.finish(0, 105.0, good=False)
    assert board.line("echo", 106.0, lambda log, since: None).startswith("echo  0/10, 1 failed")
    # A stage whose last job ends is not done where another one failed.
    board = Board({"echo": 2}, 0.0)
    for number in (0, 1):
        board.start(number, Job("echo", "", "", 1.0))
    assert board.finish(0, 5.0, good=False) is None and board.finish(1, 6.0) is None


@pytest.mark.parametrize(
    ("seconds", "text"), [(-1, "0:00"), (59.6, "1:00"), (3599, "59:59"), (3600, "1:00:00"), (7384, "2:03:04")]
)
def test_durations_read_as_a_clock(seconds, text):
    assert span(seconds) == text


@pytest.mark.parametrize(
    ("rate", "text"),
    [(12.34, "12.3/s"), (1, "1.0/s"), (0.5, "30.0/min"), (1 / 60, "1.0/min"), (1 / 1800, "2.0/h"), (1e-5, "0.0/h")],
)
def test_rates_are_in_the_unit_that_reads_best(rate, text):
    assert pace(rate) == text


def test_a_board_survives_its_file():
    board = board_of()
    again = Board.read(json.loads(json.dumps(board.kept())))
    assert again == board and again.line("echo", 112.0, lambda log, since: None) == board.line(
        "echo", 112.0, lambda log, since: None
    )


def test_progress_is_written_now_and_then_and_its_last_line_read(tmp_path):
    now, text = [0.0], io.StringIO()
    report = progress.Reporter(40, "steps", text, lambda: now[0])
    for step in range(40):
        now[0] += 0.5
        report(step + 1)
    assert text.getvalue().splitlines() == [f"progress {step}/40 steps" for step in range(4, 41, 4)]
    log = tmp_path / "train.log"
    log.write_text("x" * 9000 + "\nprogress 8/40 steps\nloss 0.4\n" + text.getvalue()[:40] + "progress 9/4")
    assert progress.last(log) == (8, 40, "steps")
    # A job in a queue has the log of an earlier run until it starts.
    written = log.stat().st_mtime
    assert progress.last(log, written) == (8, 40, "steps") and progress.last(log, written + 2) is None
    log.write_text("no such line")
    assert progress.last(log) is None and progress.last(tmp_path / "none") is None


def test_items_pass_through_unchanged():
    assert list(progress.reported("abc", 3, "letters")) == ["a", "b", "c"]
