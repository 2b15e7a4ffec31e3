"""The plan of the package: its rooms in the order in which data passes them, and which room imports which.

A room imports only earlier rooms: `tests/test_house.py` checks this, and `docs/rooms_picture.py` draws it.
"""

import ast
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
ROOMS = (
    "files", "machine", "numerics", "config", "targets", "drafting", "motion", "echo", "scene", "noise", "spectra",
    "tiles", "shards", "recognition", "recordings", "benchmark", "measure", "report", "workflow", "commands",
)  # fmt: skip


def modules(room: str) -> list[Path]:
    """Return the Python files of a room, including those in its subfolders, sorted."""
    return sorted((PACKAGE / room).rglob("*.py"))


@cache
def rooms_imported(path: Path) -> frozenset[str]:
    """Return the rooms from which a file imports, including its own room if it imports from there.

    The result is cached per process.
    """
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module == PACKAGE.name:
            names += [f"{PACKAGE.name}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.append(node.module)
    parts = [name.split(".") for name in names]
    return frozenset(part[1] for part in parts if part[0] == PACKAGE.name and len(part) > 1 and part[1] in ROOMS)


def purpose(path: Path) -> str:
    """Return the first line of a file's docstring without its full stop."""
    return (ast.get_docstring(ast.parse(path.read_text())) or "").partition("\n")[0].rstrip(".")
