"""Where the models of the zoo lie, and what file a model's name stands for."""

from pathlib import Path

from lowalt.files.errors import InputError
from lowalt.files.shipped import SHIPPED, shipped

ZOO = Path("results/zoo")
"""Where entries lie, from the working directory or, for those that come with the package, from its
folder.
"""


def names(zoo: Path = ZOO) -> list[str]:
    """Return the names of all entries, sorted."""
    paths = [*zoo.glob("*.safetensors"), *(SHIPPED / zoo).glob("*.safetensors")]
    return sorted({path.stem for path in paths})


def path_of(model: str | Path, zoo: Path = ZOO) -> Path:
    """Return the file of a model: a path, with or without .safetensors, or that of the entry of the
    zoo.

    Raises: InputError naming the entries there are.
    """
    path = Path(model)
    if path.suffix or path.is_file():
        return path
    if path.with_name(f"{path.name}.safetensors").is_file():
        return path.with_name(f"{path.name}.safetensors")
    if str(model) not in names(zoo):
        raise InputError(f"model {str(model)!r}: not a file, and {zoo} has {names(zoo)}")
    return shipped(zoo / f"{model}.safetensors")
