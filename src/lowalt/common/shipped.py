"""The place of the files that come with the package: Snakefile, rules, schema, configurations, profiles.

In a checkout they stand at its root. An installation from a wheel has them inside the package.
"""

from pathlib import Path
from typing import Any

from lowalt.common.street import PACKAGE

SHIPPED = PACKAGE / "shipped" if (PACKAGE / "shipped/Snakefile").is_file() else PACKAGE.parents[1]
"""The folder that holds `Snakefile`, `config/`, `workflow/` and `profiles/`."""

KEYS = (
    ("targets", "table"), ("targets", "records"), ("targets", "own"),
    ("recognition", "table"), ("report", "published"),
    ("report", "effect_scenes"), ("report", "accuracy"),
)  # fmt: skip
"""Block and key of every file, or list or mapping of files, that a configuration names and the package brings."""


def shipped(name: str | Path) -> Path:
    """Return `name` where the working directory has it, else the package's file of this name, if there is one."""
    found = SHIPPED / name
    return found if found.exists() and not Path(name).exists() else Path(name)


def located(config: dict, folder: Path = SHIPPED) -> dict:
    """Return the configuration with each file that only `folder` has named by its path there.

    A run in another folder, or another workflow that uses this one as a module, finds config/targets.csv that way.
    """
    result = dict(config)
    for block, key in KEYS:
        held = result.get(block)
        if isinstance(held, dict) and key in held:
            result[block] = {**held, key: _found(held[key], folder)}
    return result


def _found(value: Any, folder: Path) -> Any:
    """The value with every text in it that names a file of `folder` alone replaced by that file's path."""
    if isinstance(value, dict):
        return {name: _found(item, folder) for name, item in value.items()}
    if isinstance(value, list):
        return [_found(item, folder) for item in value]
    if isinstance(value, str) and not Path(value).exists() and (folder / value).exists():
        return str(folder / value)
    return value
