"""Disk and memory that a run will need, from measured figures, compared with what the machine has before it starts.

The figures of a rule are two lines in the size of its jobs: bytes of outputs and peak memory, each base + slope x
units. A unit is one element of the job's arrays (`units`). `space_measured.py` fits the lines to finished runs and
writes results/reference/space.csv. Pure functions of tables and numbers; only `memory` looks at the machine.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from lowalt.common.csv_tables import read_csv
from lowalt.common.plan import Plan
from lowalt.common.splits import FOLDS

COLUMNS = ("rule", "runs", "disk_base_bytes", "disk_unit_bytes", "memory_base_mib", "memory_unit_bytes", "temporary")


@dataclass(frozen=True)
class Figures:
    """Needs of one job of a rule: outputs (bytes) and peak memory (bytes) as lines in its units."""

    disk_base: float
    disk_unit: float
    memory_base: float
    memory_unit: float
    temporary: bool

    def disk(self, units: float) -> float:
        """Bytes of a job's outputs."""
        return self.disk_base + self.disk_unit * units

    def memory(self, units: float) -> float:
        """Bytes of a job's peak memory."""
        return self.memory_base + self.memory_unit * units


@dataclass(frozen=True)
class PlannedJob:
    """A job that will run: rule, wildcards, bytes of its outputs that are there already, threads it takes."""

    rule: str
    wildcards: Mapping[str, str]
    existing: int = 0
    threads: int = 1


@dataclass(frozen=True)
class Need:
    """Needs of a run: bytes it adds to the disk, bytes its largest job and its largest concurrent jobs hold."""

    disk: float
    largest_job: float
    largest_rule: str
    memory: float
    jobs: int
    unknown: tuple[str, ...]


def read(path: str | Path) -> dict[str, Figures]:
    """Return the measured figures by rule.

    Raises: InputError naming the file where it is missing or lacks columns.
    """
    return {
        row["rule"]: Figures(
            float(row["disk_base_bytes"]), float(row["disk_unit_bytes"]), float(row["memory_base_mib"]) * 2**20,
            float(row["memory_unit_bytes"]), row["temporary"] == "yes",
        )
        for row in read_csv(path, *COLUMNS)
    }  # fmt: skip


def units(rule: str, wildcards: Mapping[str, str], plan: Plan, config: dict) -> float:
    """Return the size of a job in the units of its rule.

    echo, noise and shards of signals or clean echoes: complex values; tiles and shards of images: pixels of tiles;
    views, training and evaluation: pixels of views, where these are cached; everything else: samples.
    """
    samples = _samples(wildcards, plan)
    stations, symbols = len(config["network"]["stations"]), config["network"]["symbols"]
    if rule == "echo":
        return samples / _levels(wildcards, plan) * symbols * (1 if "station" in wildcards else stations)
    kind = config["shards"]["kind"]
    if rule == "noise" or (rule == "shard" and kind != "image"):
        return samples * stations * symbols / (_levels(wildcards, plan) if (rule, kind) == ("shard", "recipe") else 1)
    if rule in ("tiles", "shard"):
        return samples * stations * 3 * config["images"]["size"] ** 2
    if rule in TRAINING and not config["recognition"]["cache"]:
        # Samples are read from the shards as they are needed.
        return 0.0
    if rule == "views" or rule in TRAINING:
        return samples * stations * 3 * int(wildcards.get("size", config["recognition"]["size"])) ** 2
    return samples


TRAINING = ("train", "evaluate", "transfer_evaluate")


def _samples(wildcards: Mapping[str, str], plan: Plan) -> float:
    """Samples that a job is about: those of its chunk, of its fold of the chunk, or all."""
    if "part" not in wildcards:
        return plan.models * sum(map(len, plan.groups.values())) * len(plan.snrs)
    group = wildcards["group"]
    chunk = plan.chunk(f"{group}-{wildcards['part']}")
    samples = chunk.count * len(chunk.members) * len(chunk.snrs)
    if "fold" not in wildcards:
        return samples
    return samples * plan.split[wildcards["fold"]] / sum(plan.split[fold] for fold in FOLDS)


def _levels(wildcards: Mapping[str, str], plan: Plan) -> int:
    """SNRs of the chunk that a job is about."""
    return len(plan.chunk(f"{wildcards['group']}-{wildcards['part']}").snrs)


def need(jobs: Iterable[PlannedJob], figures: dict[str, Figures], plan: Plan, config: dict, cores: int) -> Need:
    """Return the disk and the memory that these jobs need on a machine with so many cores.

    Outputs that are there already are written over, so only their growth counts, plus one output at a time that stands
    next to the one it replaces. Temporary outputs are counted as two for each core. Rules without figures are named.
    """
    added, replaced, temporary, memory, unknown, count = 0.0, 0.0, [], [], set(), 0
    for job in jobs:
        count += 1
        if job.rule not in figures:
            unknown.add(job.rule)
            continue
        figure, size = figures[job.rule], units(job.rule, job.wildcards, plan, config)
        if figure.temporary:
            temporary.append(figure.disk(size))
        else:
            added += figure.disk(size) - job.existing
            replaced = max(replaced, min(job.existing, figure.disk(size)))
        memory.append((figure.memory(size), job.threads, job.rule))
    memory.sort(reverse=True)
    together, free_cores = 0.0, cores
    for size, threads, _ in memory:
        if threads <= free_cores:
            together, free_cores = together + size, free_cores - threads
    disk = max(0.0, added) + replaced + sum(sorted(temporary, reverse=True)[: 2 * cores])
    largest, _, rule = memory[0] if memory else (0.0, 1, "")
    return Need(disk, largest, rule, together, count, tuple(sorted(unknown)))


NEARLY = 0.9
"""A run that needs more than this share of the free disk gets a warning."""


def verdicts(found: Need, disk_free: float, memory_free: float, memory_total: float) -> tuple[list[str], list[str]]:
    """Return sentences with figures: reasons why a run cannot finish, and warnings before it starts.

    disk_free, memory_free, memory_total: bytes.
    """
    stop, warn = [], []
    disk = f"the run will write {_size(found.disk)}, its disk has {_size(disk_free)} free"
    if found.disk > disk_free:
        stop.append(disk)
    elif found.disk > NEARLY * disk_free:
        warn.append(disk)
    if found.largest_job > memory_total:
        stop.append(
            f"a job of the rule {found.largest_rule} will need {_size(found.largest_job)} of memory, "
            f"this machine has {_size(memory_total)}"
        )
    elif found.memory > memory_free:
        warn.append(
            f"jobs that run at the same time may need {_size(found.memory)} of memory, {_size(memory_free)} are free; "
            "fewer cores need less"
        )
    return stop, warn


def _size(size: float) -> str:
    """Bytes as text in GB or MB."""
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"


def memory(root: Path = Path("/")) -> tuple[float, float]:
    """Return free and total memory (bytes) that this process may use: the machine's, or its control group's if less."""
    lines = (root / "proc/meminfo").read_text().splitlines()
    machine = {line.partition(":")[0]: 1024.0 * int(line.split()[1]) for line in lines}
    free, total = machine["MemAvailable"], machine["MemTotal"]
    for limit, used in (
        ("sys/fs/cgroup/memory.max", "sys/fs/cgroup/memory.current"),
        ("sys/fs/cgroup/memory/memory.limit_in_bytes", "sys/fs/cgroup/memory/memory.usage_in_bytes"),
    ):
        try:
            most, now = float((root / limit).read_text()), float((root / used).read_text())
        except (OSError, ValueError):
            # No such control group, or the word "max": no limit.
            continue
        if most < total:
            free, total = min(free, most - now), most
    return free, total
