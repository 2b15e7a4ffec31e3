"""The check of disk and memory at the edge: what Snakemake plans and what the machine has go into `space.py`.

The Snakefile calls `writable` when it is read, `before` when a run starts and `after` when it has failed.
"""

import os
import tempfile
from pathlib import Path

from lowalt.common.errors import InputError, SpaceError
from lowalt.common.files import free_bytes
from lowalt.common.plan import Plan
from lowalt.workflow import space

TABLE = "results/reference/space.csv"
VARIABLE = "LOWALT_SPACE"
CHOICES = ("refuse", "warn", "off")
FULL_BYTES = 1 << 20
TRIAL_BYTES = 1 << 16
ALIKE = {"echo_in_scene": "echo"}
"""Rules whose jobs write and hold as much as those of another rule, which was measured."""


def check(
    jobs: list[space.PlannedJob], plan: Plan, config: dict, cores: int | None, table: Path, folder: Path
) -> list[str]:
    """Return warnings about disk and memory for these jobs before they start.

    cores: of this machine, or None where jobs run on other machines; memory is then not checked. folder: that of
    the results. The environment variable LOWALT_SPACE decides on a run that cannot fit: refuse (default), warn, off.
    Raises: SpaceError with figures where the run cannot fit; InputError where the variable has another value.
    """
    choice = os.environ.get(VARIABLE, "refuse")
    if choice not in CHOICES:
        raise InputError(f"{VARIABLE}: {choice!r}, expected one of {CHOICES}")
    if choice == "off" or not table.is_file():
        return []
    found = space.need(jobs, space.read(table), plan, config, cores or 1)
    free, total = space.memory() if cores else (float("inf"), float("inf"))
    stop, warn = space.verdicts(found, free_bytes(folder), free, total)
    if stop and choice == "refuse":
        raise SpaceError(f"{'; '.join(stop)} (start anyway: {VARIABLE}=warn)")
    return [*stop, *warn]


def writable(folder: Path, run: str) -> None:
    """Write a nameless file of TRIAL_BYTES in the working directory, in `results`, in the run's folder and in the
    folders there: Snakemake meets a full or read-only one with tracebacks.

    Raises: InputError with the reason and what is free where that fails, and where `results` is a link to nothing.
    """
    results = folder / "results"
    if results.is_symlink() and not results.exists():
        raise InputError(f"{results}: a link to {results.readlink()}, which is not there (is its disk mounted?)")
    own = results / run
    for place in (folder, *(place for place in (results, own, *sorted(own.glob("*/"))) if place.exists())):
        try:
            with tempfile.TemporaryFile(dir=place) as file:
                file.write(bytes(TRIAL_BYTES))
        except OSError as error:
            facts = f"{error.strerror}, {free_bytes(place) / 1e6:.1f} MB free"
            raise InputError(f"{place.resolve()}: cannot write into this folder ({facts})") from None


def before(workflow: object, plan: Plan, config: dict) -> None:
    """Compare what a run of Snakemake needs with what there is, before its first job.

    Raises: SpaceError with figures where the run cannot fit.
    """
    from snakemake.logging import logger

    jobs = [
        space.PlannedJob(
            ALIKE.get(job.rule.name, job.rule.name),
            dict(job.wildcards_dict),
            sum(path.stat().st_size for path in map(Path, map(str, job.output)) if path.is_file()),
            job.threads,
        )
        for job in workflow.dag.needrun_jobs()
    ]
    cores = workflow.cores if workflow.local_exec else None
    for line in check(jobs, plan, config, cores, Path(workflow.basedir) / TABLE, Path.cwd() / "results"):
        logger.warning(f"warning: {line}")


def after(folder: Path = Path()) -> None:
    """Log one line if the disk is full: a failed job may not have had room to write its own message."""
    from snakemake.logging import logger

    free = free_bytes(folder / "results")
    if free < FULL_BYTES:
        logger.error(
            f"error: the disk of {(folder / 'results').resolve()} is full ({free / 1e6:.1f} MB free); "
            "make room, then start the same command again: it goes on where it stopped"
        )
