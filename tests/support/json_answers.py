"""What command lines print with --json, held against the page of the reference."""

import json
from pathlib import Path

from lowalt.__main__ import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/reference/json.md").read_text()
STATIC = ("settings", "stages", "by_class", "method", "otherwise", "materials", "dropped", "notes")
"""Keys whose own keys are names of settings, stages, classes, fields, filters, materials or reasons that the
reference does not list."""


def refused(text: str) -> None:
    """Refuse a number that JSON does not have."""
    raise AssertionError(f"{text} is not JSON")


def keys(value: object) -> set[str]:
    """All keys of nested values, without those below STATIC."""
    if isinstance(value, list):
        return set().union(*map(keys, value)) if value else set()
    if not isinstance(value, dict):
        return set()
    return set(value).union(*(keys(item) for name, item in value.items() if name not in STATIC))


def answered(capsys, *words: object) -> tuple[dict, int]:
    """What a command line prints with --json, and its exit status; every key stands on the page of
    the reference.
    """
    status = main([*map(str, words), "--json"])
    found = json.loads(capsys.readouterr().out, parse_constant=refused)
    missing = {key for key in keys(found) if f"`{key}`" not in PAGE}
    assert not missing
    return found, status
