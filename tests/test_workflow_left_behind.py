"""Jobs that a dead run left behind get a signal, time to end, and then another one."""

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
