"""Section: what made the run, and the commands that make it again.

It lists revision, seeds, machines, versions, checksums and configuration.
"""

import platform
from importlib.metadata import PackageNotFoundError, version

import yaml

from lowalt.files.shipped import as_named, shipped
from lowalt.files.yaml_files import load_yaml
from lowalt.machine.hardware import describe
from lowalt.report.provenance import changes, checksums, code_sum, commands, revision
from lowalt.report.reported_run import ReportedRun

NAMES = (
    "lowalt",
    "snakemake",
    "numpy",
    "scipy",
    "numba",
    "llvmlite",
    "pillow",
    "deflate",
    "trimesh",
    "pymeshlab",
    "torch",
    "torchvision",
    "timm",
    "matplotlib",
)
"""Packages whose version can change a run's outputs, or the page."""
BASE = "config/default.yaml"


def versions() -> list[tuple[str, str]]:
    """Return (name, version) of Python and of every package of NAMES."""
    rows = [("Python", platform.python_version())]
    for name in NAMES:
        try:
            rows.append((name, version(name)))
        except PackageNotFoundError:
            rows.append((name, "not installed"))
    return rows


def machines(run: ReportedRun) -> list[tuple[str, str]]:
    """Return (product, machine) of the trainings, by their own records, and of the page."""
    rows = run.inputs.table("seeds")
    trained = {
        f"training: {row['protocol']} {row['scheme']}, seed {row['seed']}": row.get("hardware", "")
        for row in rows
    }
    return [
        ("this page", describe()),
        *((name, machine) for name, machine in trained.items() if machine),
    ]


def values(run: ReportedRun) -> dict:
    """Return the facts on what made the run, and the commands again."""
    commit = revision()
    lines, overlay = commands(commit, changes(load_yaml(shipped(BASE)), as_named(run.config)))
    return {
        "commit": commit,
        "code": code_sum(),
        "seed": run.config["seed"],
        "seeds": run.config["recognition"]["seeds"],
        "machines": machines(run),
        "versions": versions(),
        "files": checksums(run.inputs.files),
        "commands": lines,
        "overlay": overlay,
        "configuration": yaml.safe_dump(run.config, sort_keys=False, allow_unicode=True),
    }
