"""The plan of the package: the core's rooms in the order of imports, and the extensions.

A room imports only earlier rooms; an extension imports any. A room of the core imports no
extension: `tests/test_house.py` checks this, and `docs/rooms_picture.py` draws it.
"""

import ast
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
ROOMS = (
    "files",
    "machine",
    "numerics",
    "config",
    "targets",
    "motion",
    "echo",
    "scene",
    "noise",
    "spectra",
    "tiles",
    "shards",
    "recognition",
    "measure",
    "report",
    "workflow",
    "commands",
)


EXTENSIONS = tuple(
    f"extensions/{path.parent.name}" for path in sorted(PACKAGE.glob("extensions/*/__init__.py"))
)
"""The folders of the extensions; none where they have been removed."""


def modules(room: str) -> list[Path]:
    """Return the Python files of a room or an extension and of its subfolders, sorted."""
    return sorted((PACKAGE / room).rglob("*.py"))


@cache
def rooms_imported(path: Path) -> frozenset[str]:
    """Return the rooms and extensions from which a file imports, its own if it imports from there.

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
    result = set()
    for name in names:
        package, _, inside = name.partition(".")
        room, _, below = inside.partition(".")
        if package != PACKAGE.name:
            continue
        if room in ROOMS:
            result.add(room)
        elif room == "extensions" and below:
            result.add(f"extensions/{below.partition('.')[0]}")
    return frozenset(result)


def purpose(path: Path) -> str:
    """Return the first paragraph of a file's docstring on one line, without its full stop."""
    docstring = ast.get_docstring(ast.parse(path.read_text())) or ""
    paragraph = docstring.partition("\n\n")[0]
    return " ".join(paragraph.split()).rstrip(".")
