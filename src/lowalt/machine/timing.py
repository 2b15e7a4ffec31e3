"""Timers for all measured times: the median of alternating calls, and the least of several."""

import statistics
import time
from collections.abc import Callable

CALLS = 30
"""Calls of which `least_s` takes the least time."""


def in_turn(
    calls: list[tuple[Callable[[], object], int, int]],
    clock: Callable[[], float] = time.perf_counter,
) -> list[tuple[float, object]]:
    """Return the median seconds and the last result of each call.

    A call is given as (call, rounds, times a round).
    Calls alternate, so that a slow second of the machine affects all of them.
    """
    spent: list[list[float]] = [[] for _ in calls]
    results: list[object] = [None] * len(calls)
    for turn in range(max(rounds for _, rounds, _ in calls)):
        for index, (call, rounds, times) in enumerate(calls):
            if turn >= rounds:
                continue
            for _ in range(times):
                seconds, results[index] = once(call, clock)
                spent[index].append(seconds)
    medians = [statistics.median(seconds) for seconds in spent]
    return list(zip(medians, results, strict=True))


def median_s(work: Callable[[], object], repeats: int) -> float:
    """Return the median seconds of `repeats` calls, after one that warms up."""
    work()
    return in_turn([(work, repeats, 1)])[0][0]


def least_s(work: Callable[[], object], limit_s: float, clock: Callable[[], float]) -> float:
    """Return the least time (s) by `clock` of up to CALLS calls, after one that warms up.

    Calls stop once they took `limit_s` together. If the first call alone takes that long, its time
    is the result.
    """
    spent, _ = once(work, clock)
    if spent > limit_s:
        return spent
    best = float("inf")
    for _ in range(CALLS):
        seconds, _ = once(work, clock)
        best = min(best, seconds)
        spent += seconds
        if spent > limit_s:
            break
    return best


def once(work: Callable[[], object], clock: Callable[[], float]) -> tuple[float, object]:
    """Return the time (s) by `clock` that one call took, and its result."""
    start = clock()
    result = work()
    return clock() - start, result
