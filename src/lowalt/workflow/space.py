"""Checks whether the disk is writable and whether a run's files fit on it.

The Snakefile calls `writable` when it is read and `before` when a run starts; the display names a
disk that is full.
"""

import os
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lowalt.config.splits import FOLDS
from lowalt.files.atomic import free_bytes
from lowalt.files.errors import InputError, SpaceError
from lowalt.shards.plan import Plan
from lowalt.shards.sizes import cell_type, sample_bytes
from lowalt.spectra.catalogue import named

VARIABLE = "LOWALT_SPACE"
TRIAL_BYTES = 1 << 16
SIGNAL_BYTES = 8
"""Bytes of a complex value of a signal, complex64."""


def written(rule: str, wildcards: Mapping[str, str], plan: Plan, config: dict) -> float:
    """Return the bytes that a job leaves; 0 where it leaves little, or temporary files."""
    if "part" not in wildcards:
        return 0.0
    chunk = plan.chunk(f"{wildcards['group']}-{wildcards['part']}")
    models = chunk.count * len(chunk.members)
    stations = len(config["network"]["stations"])
    values = models * stations * config["network"]["symbols"]
    if rule in ("echo", "echo_in_scene"):
        if "station" in wildcards:
            values = values / stations
        return SIGNAL_BYTES * values
    if rule == "noise":
        return SIGNAL_BYTES * values * len(chunk.snrs)
    if rule not in ("shard", "views"):
        return 0.0
    share = plan.split[wildcards["fold"]] / sum(plan.split[fold] for fold in FOLDS)
    samples = share * models * len(chunk.snrs) / len(plan.pieces(chunk.name, wildcards["fold"]))
    if rule == "views":
        return samples * stations * len(named(config["spectra"])) * int(wildcards["size"]) ** 2
    return samples * sample_bytes(config)


def cubes_size(config: dict, plan: Plan) -> dict:
    """Return the size of a data set of cubes; empty for shards of other kinds.

    Keys: number of `samples`, bytes per sample (`sample_bytes`) and in all (`bytes`), and the type
    of the stored `cells`.
    """
    if config["shards"]["kind"] != "cube":
        return {}
    size = sample_bytes(config)
    count = plan.samples
    return {
        "cells": cell_type(config),
        "samples": count,
        "sample_bytes": size,
        "bytes": count * size,
    }


def cubes_sentence(size: dict) -> str:
    """Return `cubes_size` as one line."""
    sample_mb = size["sample_bytes"] / 1e6
    total_gb = size["bytes"] / 1e9
    samples = f"{size['samples']} samples, {size['cells']}"
    return f"cube shards: {sample_mb:.2f} MB per sample, {total_gb:.3f} GB in all ({samples})"


def check(needed: float, folder: Path) -> None:
    """Refuse a run whose files do not fit on a folder's disk, unless LOWALT_SPACE is "off".

    needed: bytes. Raises: SpaceError with both sizes; InputError where the variable has another
    value.
    """
    choice = os.environ.get(VARIABLE)
    if choice not in (None, "off"):
        raise InputError(f"{VARIABLE}: {choice!r}, expected off, or no such variable")
    free = free_bytes(folder)
    if needed > free and not choice:
        raise SpaceError(
            f"the run will write {needed / 1e6:.1f} MB, its disk has {free / 1e6:.1f} MB free "
            f"(start anyway: {VARIABLE}=off)"
        )


def before(workflow: Any, plan: Plan, config: dict) -> None:
    """Before the first job, print the size of cubes and compare a run's bytes with the free space.

    Existing outputs are not counted. workflow: Snakemake's workflow object. Raises: as `check`.
    """
    size = cubes_size(config, plan)
    if size:
        print(cubes_sentence(size), file=sys.stderr)
    needed = 0.0
    for job in workflow.dag.needrun_jobs():
        outputs = [Path(str(name)) for name in job.output]
        there = sum(path.stat().st_size for path in outputs if path.is_file())
        left = written(job.rule.name, dict(job.wildcards_dict), plan, config)
        needed += max(0.0, left - there)
    check(needed, Path.cwd() / "results")


def writable(folder: Path, run: str) -> None:
    """Test writing: put an unnamed file of TRIAL_BYTES into each folder of a run.

    These are the working directory, `results`, the run's folder and its subfolders. In a full or
    read-only one Snakemake would end with a traceback.

    Raises: InputError with the reason and the free space if that fails, or if `results` is a
    dangling link.
    """
    results = folder / "results"
    if results.is_symlink() and not results.exists():
        raise InputError(
            f"{results}: a link to {results.readlink()}, which is not there (is its disk mounted?)"
        )
    made = results / run
    below = [path for path in (results, made, *sorted(made.glob("*/"))) if path.exists()]
    for tried in (folder, *below):
        try:
            with tempfile.TemporaryFile(dir=tried) as file:
                file.write(bytes(TRIAL_BYTES))
        except OSError as error:
            facts = f"{error.strerror}, {free_bytes(tried) / 1e6:.1f} MB free"
            raise InputError(
                f"{tried.resolve()}: cannot write into this folder ({facts})"
            ) from None
