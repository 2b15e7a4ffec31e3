"""Locates the files that come with the package: Snakefile, rules, schema, configurations, profiles.

In a checkout they are at its root; a wheel installs them inside the package.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lowalt.files.package_plan import PACKAGE

SHIPPED = PACKAGE / "shipped" if (PACKAGE / "shipped/Snakefile").is_file() else PACKAGE.parents[1]
"""The folder that holds `Snakefile`, `config/`, `workflow/` and `profiles/`."""

KEYS = (
    ("targets", "table"),
    ("targets", "records"),
    ("targets", "own"),
    ("motion", "track"),
    ("recognition", "table"),
    ("report", "published"),
    ("report", "accuracy"),
)
"""Block and key of every file, or list or mapping of files, that a configuration names and the
package brings.
"""


def _exists(path: str | Path) -> bool:
    """Whether a file or folder is there; a name that no file can have is nowhere."""
    try:
        return Path(path).exists()
    except (OSError, ValueError):
        return False


def shipped(name: str | Path) -> Path:
    """Return `name` as a path, or the package's file of this name if only the package has it."""
    if _exists(SHIPPED / name) and not _exists(name):
        return SHIPPED / name
    return Path(name)


def located(config: dict, folder: Path = SHIPPED) -> dict:
    """Return the configuration with absolute paths for files that exist only in `folder`.

    A run in another folder, or another workflow that uses this one as a module, finds
    config/targets.csv that way.
    """

    def packaged(name: str) -> str:
        """The path in `folder` of a file that only it has, else the name."""
        if _exists(folder / name) and not _exists(name):
            return str(folder / name)
        return name

    return _renamed(config, packaged)


def as_named(config: dict, folder: Path = SHIPPED) -> dict:
    """Return the configuration with files of `folder` named relative to it, unlike `located`.

    Files that a run stores or shares then do not depend on the place of installation. A path stays
    absolute if its relative name would mean another file in the working directory.
    """

    def named(name: str) -> str:
        """The name relative to `folder` of a file there, unless it means another file here."""
        path = Path(name)
        if not path.is_absolute() or not path.is_relative_to(folder):
            return name
        relative = path.relative_to(folder)
        if relative.exists() and not relative.samefile(path):
            return name
        return str(relative)

    return _renamed(config, named)


def _renamed(config: dict, rename: Callable[[str], str]) -> dict:
    """The configuration with the names under KEYS changed by `rename`."""
    result = dict(config)
    for block, key in KEYS:
        held = result.get(block)
        if isinstance(held, dict) and key in held:
            result[block] = {**held, key: _each(held[key], rename)}
    return result


def _each(value: Any, rename: Callable[[str], str]) -> Any:
    """The value with every text in it changed by `rename`."""
    if isinstance(value, dict):
        return {name: _each(item, rename) for name, item in value.items()}
    if isinstance(value, list):
        return [_each(item, rename) for item in value]
    return rename(value) if isinstance(value, str) else value
