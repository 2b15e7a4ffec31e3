"""The versions of what a run was made with."""

import platform
from importlib.metadata import PackageNotFoundError, version

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
