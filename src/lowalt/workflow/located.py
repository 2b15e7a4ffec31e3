"""Files that a configuration names, found from any working directory: there first, then in this checkout.

A workflow that uses this one as a module runs elsewhere, and names like config/targets.csv are meant for the checkout.
"""

from pathlib import Path
from typing import Any

KEYS = (
    ("targets", "table"), ("targets", "records"), ("targets", "own"),
    ("recognition", "table"), ("report", "published"),
    ("report", "effect_scenes"), ("report", "accuracy"),
)  # fmt: skip
"""Block and key of every file, or list or mapping of files, that comes with the checkout."""


def located(config: dict, checkout: Path) -> dict:
    """Return the configuration with each file that only the checkout has named by its path there."""
    result = dict(config)
    for block, key in KEYS:
        held = result.get(block)
        if isinstance(held, dict) and key in held:
            result[block] = {**held, key: _found(held[key], checkout)}
    return result


def _found(value: Any, checkout: Path) -> Any:
    if isinstance(value, dict):
        return {name: _found(item, checkout) for name, item in value.items()}
    if isinstance(value, list):
        return [_found(item, checkout) for item in value]
    if isinstance(value, str) and not Path(value).exists() and (checkout / value).exists():
        return str(checkout / value)
    return value
