"""Progress of a run, one line per stage: finished and total jobs, rate, time left, running jobs.
Counts and text only.

Times are seconds since the epoch, so that another process can read a board from a file.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field

from lowalt.machine.progress import Progress

Reader = Callable[[str, float], Progress | None]
"""Reads a job's progress from its log, given the job's start (s): an older log may be that of an
earlier run.
"""

LEAST_PART = 0.1
"""Progress of a job before the first estimate of the time left, because a job first imports and
compiles code.
"""


@dataclass
class Job:
    """A running job: its stage, its wildcards as a label, its log and its start time (s)."""

    stage: str
    label: str
    log: str
    started: float


@dataclass
class Stage:
    """Jobs of one rule: their number, how many are done, when the first started and the last ended
    (s).
    """

    total: int
    done: int = 0
    failed: int = 0
    started: float | None = None
    ended: float | None = None


@dataclass
class Board:
    """The stages of one run in order of their start, and the running jobs by id."""

    totals: dict[str, int]
    started: float
    stages: dict[str, Stage] = field(default_factory=dict)
    jobs: dict[str, Job] = field(default_factory=dict)

    @classmethod
    def read(cls, kept: dict) -> "Board":
        """Return the board from the plain values of `kept`."""
        stages = {name: Stage(**stage) for name, stage in kept["stages"].items()}
        jobs = {name: Job(**job) for name, job in kept["jobs"].items()}
        return cls(kept["totals"], kept["started"], stages, jobs)

    def kept(self) -> dict:
        """Return the board as plain values, for a file."""
        return asdict(self)

    def start(self, job_id: object, job: Job) -> bool:
        """Record the start of a job; return whether it is the first of its stage."""
        new = job.stage not in self.stages
        stage = self.stages.setdefault(job.stage, Stage(self.totals.get(job.stage, 0)))
        stage.started = job.started if stage.started is None else stage.started
        self.jobs[str(job_id)] = job
        return new

    def finish(self, job_id: object, now: float, good: bool = True) -> str | None:
        """Record the end of a job; return its stage if that was the stage's last job, else None."""
        job = self.jobs.pop(str(job_id), None)
        if job is None:
            return None
        stage = self.stages[job.stage]
        stage.ended = now
        stage.done = stage.done + good
        stage.failed = stage.failed + (not good)
        return job.stage if stage.done >= stage.total else None

    def running(self) -> list[str]:
        """Return the stages with a running job, in order of their start."""
        active = {job.stage for job in self.jobs.values()}
        return [name for name in self.stages if name in active]

    def total(self, now: float) -> str:
        """Return the line of the whole run."""
        done = sum(stage.done for stage in self.stages.values())
        planned = sum(self.totals.values())
        return f"{'all':<{self._width}} {done}/{planned} jobs, {span(now - self.started)} since the start"

    @property
    def _width(self) -> int:
        """Characters of the longest name of a stage."""
        return max(map(len, [*self.totals, *self.stages, "all"]))

    def line(self, name: str, now: float, read: Reader) -> str:
        """Return the line of one stage."""
        stage = self.stages[name]
        head = f"{name:<{self._width}} {stage.done}/{stage.total}"
        head += f", {stage.failed} failed" if stage.failed else ""
        now_running = {key: job for key, job in self.jobs.items() if job.stage == name}
        if not now_running and stage.done >= stage.total:
            return f"{head}, done in {span(stage.ended - stage.started)}"
        progress_of = {key: read(job.log, job.started) for key, job in now_running.items()}
        parts = sum(
            progress.done / progress.total
            for progress in progress_of.values()
            if progress and progress.total
        )
        done = stage.done + parts
        spent = now - stage.started
        if spent > 0 and (stage.done or parts >= LEAST_PART):
            head += f", {pace(stage.done / spent)}" if stage.done else ""
            head += f", {span((stage.total - done) * spent / done)} left"
        texts = [_running(job, progress_of[key]) for key, job in now_running.items()]
        return head + "".join(f"; {text}" for text in texts if text)


def _running(job: Job, progress: Progress | None) -> str:
    """Return the job's wildcards and, where its log tells, how much of it is done."""
    parts = f"{progress.done}/{progress.total} {progress.unit}" if progress else ""
    return f"{job.label} {parts}".strip()


def span(seconds: float) -> str:
    """Return a duration as minutes and seconds, or hours, minutes and seconds."""
    whole = max(0, round(seconds))
    hours = whole // 3600
    minutes = whole // 60 % 60
    remainder = whole % 60
    return f"{hours}:{minutes:02}:{remainder:02}" if hours else f"{minutes}:{remainder:02}"


def pace(per_second: float) -> str:
    """Return a rate in jobs per second, minute or hour: the first of these units that gives at
    least one.
    """
    for factor, unit in ((1, "s"), (60, "min"), (3600, "h")):
        if per_second * factor >= 1 or unit == "h":
            return f"{per_second * factor:.1f}/{unit}"
    raise AssertionError("the last unit always returns")
