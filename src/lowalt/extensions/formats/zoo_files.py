"""The entries of the zoo by name, and where they lie."""

from pathlib import Path

from lowalt.files.shipped import SHIPPED, shipped

ZOO = Path("results/zoo")
"""Where entries lie, from the working directory or, for those that come with the package, from its
folder.
"""


def names() -> list[str]:
    """Return the names of all entries, sorted."""
    return sorted(
        {path.stem for folder in (ZOO, SHIPPED / ZOO) for path in folder.glob("*.safetensors")}
    )


def path_of(name: str) -> Path:
    """Return the file of the entry of this name."""
    return shipped(ZOO / f"{name}.safetensors")
