"""The entries of the zoo by name, and where they lie."""

from pathlib import Path

from lowalt.files.shipped import SHIPPED, shipped

ZOO = Path("results/zoo")
"""Where entries lie, from the working directory or from the package's own folder."""


def names() -> list[str]:
    """Return the names of all entries, sorted."""
    found: set[str] = set()
    for folder in (ZOO, SHIPPED / ZOO):
        found |= {path.stem for path in folder.glob("*.safetensors")}
    return sorted(found)


def path_of(name: str) -> Path:
    """Return the file of the entry of this name."""
    return shipped(ZOO / f"{name}.safetensors")
