"""Jobs that a dead run left behind get a signal, time to end, and then another one."""

import errno
import fcntl
import os
import signal
from types import SimpleNamespace

import pytest

from lowalt.workflow import locks


@pytest.mark.parametrize(("stubborn", "signals", "spent_s"), [
    ((), [signal.SIGTERM], 0.2), ((signal.SIGTERM,), [signal.SIGTERM, signal.SIGKILL], 10.2),
    ((signal.SIGTERM, signal.SIGKILL), [signal.SIGTERM, signal.SIGKILL], 20.1),
])  # fmt: skip
def test_jobs_have_ten_seconds_to_end_before_they_are_killed(stubborn, signals, spent_s, monkeypatch):
    """Two jobs end 0.2 s after the first signal that they heed; time passes only while the code sleeps."""
    sent, now, over = [], [0.0], [float("inf")]

    def kill(pid, number):
        sent.append((pid, number))
        if number not in stubborn:
            over[0] = min(over[0], now[0] + 0.19)

    def sleep(seconds):
        now[0] += seconds

    monkeypatch.setattr(locks.os, "kill", kill)
    monkeypatch.setattr(locks, "time", SimpleNamespace(monotonic=lambda: now[0], sleep=sleep))
    owner = SimpleNamespace(left_behind=lambda: [] if now[0] >= over[0] else [11, 12])
    assert locks.end(owner) == [11, 12]
    assert sent == [(pid, number) for number in signals for pid in (11, 12)]
    assert now[0] == pytest.approx(spent_s, abs=0.11)


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS])
def test_every_user_may_open_the_guard_and_a_system_without_locks_is_refused(number, tmp_path, monkeypatch):
    before = os.umask(0)
    try:
        with locks.guarded(tmp_path):
            pass
    finally:
        os.umask(before)
    assert (tmp_path / "lowalt.guard").stat().st_mode & 0o777 == 0o666

    def refuse(descriptor, how):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with pytest.raises(OSError, match=os.strerror(number)), locks.guarded(tmp_path):
        pytest.fail("the block runs without a lock")


@pytest.mark.parametrize("left", [(), ("0.owner.json",), ("0.input.lock",), ("0.output.lock", "0.owner.json")])
def test_what_a_crash_left_of_a_lock_is_removed(left, tmp_path):
    for name in (*left, "1.output.lock"):
        (tmp_path / name).touch()
    locks.drop(tmp_path, 0)
    assert [path.name for path in tmp_path.iterdir()] == ["1.output.lock"]
