"""What Snakemake measured of a finished job, from the job's benchmark file."""

import json
from pathlib import Path
from typing import NamedTuple

from lowalt.files.atomic import text_of
from lowalt.files.errors import InputError


class JobTimes(NamedTuple):
    """Rule, elapsed and processor time (s) and largest memory (MiB) of a job."""

    rule: str
    wall_s: float
    processor_s: float
    peak_mib: float


def job_times(path: str | Path) -> JobTimes:
    """Return what was measured of a job's last run, which made the files that are there.

    A file of extended JSON lines has a line for each run. Snakemake writes null or "NA" for what it
    could not measure of a job shorter than its sampling interval; such a reading counts as 0.
    Raises: InputError naming a file that is missing or no such file.
    """
    try:
        last = json.loads(text_of(path, "benchmark").splitlines()[-1])
        readings = [last["s"], last["cpu_time"], last["max_rss"]]
        rule = last["rule_name"]
    except (ValueError, IndexError, KeyError, TypeError) as error:
        raise InputError(f"{path}: not an extended benchmark file ({error!r})") from error
    numbers = []
    for reading in readings:
        numbers.append(float(reading) if isinstance(reading, (int, float)) else 0.0)
    return JobTimes(rule, *numbers)
