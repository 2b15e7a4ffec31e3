"""Scheduling rounds of Snakemake that cost the same however many jobs have finished or wait.

Three faults of `snakemake.scheduling.job_scheduler.JobScheduler`, in every version from 8.30 to 9.27:

TIMERS      Each round starts a timer that starts another round `--max-jobs-per-timespan` later (1 s), and each finished
            job starts a round. So after n finished jobs there are n rounds a second, for as long as the run lasts.
WAITING     Each round computes params, resources and input sizes of all jobs that are ready, also of those that no free
            core could take.
REMAINING   Each round lists all jobs that have not finished, for a scheduler that does not look at the list.

`install` replaces the methods where the installed version has the fault, and leaves others as they are.
"""

import inspect
import threading
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from heapq import nsmallest
from typing import Any

SIGNS = {
    "TIMERS": (
        ("_schedule_reevalutation", "lambda: self._open_jobs.release()"),
        ("schedule", "self._schedule_reevalutation(self.job_rate_limiter.timespan)"),
    ),
    "WAITING": (
        ("open_jobs", "jobs = list(self.workflow.dag.ready_jobs)"),
        ("schedule", "job.reset_params_and_resources()"),
    ),
    "REMAINING": (
        ("remaining_jobs", "for job in self.workflow.dag.needrun_jobs()"),
        ("job_selector", "jobs, self.remaining_jobs, self.resources, self._input_sizes"),
    ),
}
"""Methods and lines of their source: a scheduler has the fault if all of its lines are there."""

LEAST = 8
"""Ready jobs of each rule that a round looks at, on a machine with few cores."""


def faults(scheduler: type) -> set[str]:
    """Return which of the faults the source of a scheduler class has."""
    return {name for name, signs in SIGNS.items() if all(text in _source(scheduler, method) for method, text in signs)}


def _source(scheduler: type, method: str) -> str:
    """Source text of a method or property, empty where the class has none."""
    found = inspect.getattr_static(scheduler, method, None)
    function = found.fget if isinstance(found, property) else found
    return inspect.getsource(function) if function else ""


def install() -> None:
    """Mend Snakemake's scheduler for this process, once."""
    from snakemake.scheduling.job_scheduler import JobScheduler

    found = faults(JobScheduler)
    if "TIMERS" in found:
        JobScheduler._schedule_reevalutation = one_timer
    if "WAITING" in found:
        JobScheduler.open_jobs = property(selectable)
    if "REMAINING" in found:
        JobScheduler.remaining_jobs = property(Unfinished)


def by_job(priority: Callable) -> Callable | int:
    """Return a function that gives each job its priority, or 0 where Snakemake knows one priority a rule only."""
    from snakemake.rules import Rule

    return priority if hasattr(Rule, "expand_priority") else 0


def one_timer(self: Any, delay: float) -> None:
    """Start a round after `delay` seconds, unless one is already to come."""
    timer = getattr(self, "_next_round", None)
    if timer is None or timer.finished.is_set() or not timer.is_alive():
        self._next_round = threading.Timer(delay, self._open_jobs.release)
        # A run that has ended does not wait for its timer.
        self._next_round.daemon = True
        self._next_round.start()


def selectable(self: Any) -> list[Any]:
    """Return the ready jobs of which a round chooses: the first of each rule, as many as could start at once.

    Jobs of one rule mostly need the same cores and resources, so jobs of every rule are looked at. The list is empty
    only where no job is ready.
    """
    limiter, cores = self.job_rate_limiter, self.global_resources.get("_cores", 1)
    most = max(LEAST, 2 * min(cores, limiter.max_jobs if limiter else cores))
    ready = list(self.workflow.dag.ready_jobs)
    if len(ready) <= most:
        return ready
    known = self.__dict__.setdefault("_entries", {})
    by_rule = defaultdict(list)
    for job in ready:
        # By identity: a job's own hash is computed in Python, and this loop passes all ready jobs in every round.
        rule, entry = known.get(id(job)) or known.setdefault(id(job), _entry(job))
        by_rule[rule].append(entry)
    return [job for entries in by_rule.values() for *_, job in nsmallest(most, entries)]


def _entry(job: Any) -> tuple[str, tuple]:
    """A job's rule (groups of jobs are one kind), and its place: high priority first, then as planned."""
    return "" if job.is_group() else job.rule.name, (-job.priority, job.jobid, job)


class Unfinished(Sequence):
    """The jobs of a scheduler that have not finished and do not run, listed only when an item is read."""

    def __init__(self, scheduler: Any) -> None:
        """Keep the scheduler whose jobs are listed."""
        self._scheduler = scheduler

    def _jobs(self) -> list[Any]:
        """Jobs that have neither finished nor failed and do not run."""
        scheduler = self._scheduler
        dag, taken = scheduler.workflow.dag, scheduler.running | scheduler.failed
        return [job for job in dag.needrun_jobs() if job not in taken and not dag.finished(job)]

    def __iter__(self) -> Iterator[Any]:
        return iter(self._jobs())

    def __len__(self) -> int:
        return len(self._jobs())

    def __getitem__(self, index: Any) -> Any:
        return self._jobs()[index]
