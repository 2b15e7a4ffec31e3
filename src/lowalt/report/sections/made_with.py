"""Section: what made the run: seed, hardware, checksum of the data set, versions of packages, whole configuration."""

import platform
from importlib.metadata import PackageNotFoundError, version

import yaml

from lowalt.common.files import sha256
from lowalt.common.hardware import describe
from lowalt.report.run import Run

NAMES = ("lowalt", "snakemake", "numpy", "scipy", "numba", "pillow", "deflate", "torch", "torchvision", "timm")


def versions() -> list[str]:
    """Return "name version" of Python and every package whose version can change a run's outputs."""
    found = [f"Python {platform.python_version()}"]
    for name in NAMES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} not installed")
    return found


def values(run: Run) -> dict:
    """Return the seed, the hardware, the checksum of the shards' index, the versions, and the configuration as YAML."""
    made = {"seed": run.config["seed"], "hardware": describe(), "index": sha256(run.inputs.path("index"))}
    return {**made, "versions": versions(), "configuration": yaml.safe_dump(run.config, sort_keys=False)}
