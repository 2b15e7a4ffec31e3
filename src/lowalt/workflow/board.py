"""Progress of a run, one line per stage: finished and total jobs, rate, time left, running jobs.

Times are seconds since the epoch, so that another process can read a board from a file.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field

from lowalt.machine.progress import Progress

Reader = Callable[[str, float], Progress | None]
"""Reads a job's progress from its log, given its start (s): an older log is of an earlier run."""

LEAST_SHARE = 0.1
"""Share of a job that is done before the first estimate of the time left.

A job first imports and compiles code.
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
    """Jobs of one rule: their number, how many are done or failed, first start and last end (s)."""

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
        if stage.started is None:
            stage.started = job.started
        self.jobs[str(job_id)] = job
        return new

    def finish(self, job_id: object, now: float, good: bool = True) -> str | None:
        """Record the end of a job; return its stage if that was the stage's last job, else None."""
        job = self.jobs.pop(str(job_id), None)
        if job is None:
            return None
        stage = self.stages[job.stage]
        stage.ended = now
        if good:
            stage.done += 1
        else:
            stage.failed += 1
        if stage.done < stage.total:
            return None
        return job.stage

    def running(self) -> list[str]:
        """Return the stages with a running job, in order of their start."""
        active = {job.stage for job in self.jobs.values()}
        return [name for name in self.stages if name in active]

    def total(self, now: float) -> str:
        """Return the line of the whole run."""
        done = sum(stage.done for stage in self.stages.values())
        planned = sum(self.totals.values())
        spent = span(now - self.started)
        return f"{'all':<{self._width}} {done}/{planned} jobs, {spent} since the start"

    @property
    def _width(self) -> int:
        """Characters of the longest name of a stage."""
        return max(map(len, [*self.totals, *self.stages, "all"]))

    def line(self, name: str, now: float, read: Reader) -> str:
        """Return the line of one stage."""
        stage = self.stages[name]
        text = f"{name:<{self._width}} {stage.done}/{stage.total}"
        if stage.failed:
            text += f", {stage.failed} failed"
        running = [job for job in self.jobs.values() if job.stage == name]
        started = now if stage.started is None else stage.started
        if not running and stage.done >= stage.total:
            ended = now if stage.ended is None else stage.ended
            return f"{text}, done in {span(ended - started)}"
        shares = 0.0
        of_jobs = ""
        for job in running:
            progress = read(job.log, job.started)
            if progress and progress.total:
                shares += progress.done / progress.total
            words = _running(job, progress)
            if words:
                of_jobs += f"; {words}"
        done = stage.done + shares
        spent = now - started
        if spent > 0 and (stage.done or shares >= LEAST_SHARE):
            if stage.done:
                text += f", {pace(stage.done / spent)}"
            text += f", {span((stage.total - done) * spent / done)} left"
        return text + of_jobs


def _running(job: Job, progress: Progress | None) -> str:
    """Return the job's wildcards and, where its log tells, how much of it is done."""
    if progress is None:
        return job.label.strip()
    return f"{job.label} {progress.done}/{progress.total} {progress.unit}".strip()


def span(seconds: float) -> str:
    """Return a duration as minutes and seconds, or hours, minutes and seconds."""
    whole = max(0, round(seconds))
    hours = whole // 3600
    minutes = whole // 60 % 60
    remainder = whole % 60
    if hours:
        return f"{hours}:{minutes:02}:{remainder:02}"
    return f"{minutes}:{remainder:02}"


def pace(per_second: float) -> str:
    """Return a rate in jobs per second, minute or hour: the first unit that gives at least one."""
    if per_second >= 1:
        return f"{per_second:.1f}/s"
    if per_second * 60 >= 1:
        return f"{per_second * 60:.1f}/min"
    return f"{per_second * 3600:.1f}/h"
