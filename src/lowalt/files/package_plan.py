"""The plan of the package: the core's rooms, each importing only earlier ones, and the extensions,
which import any.

A room of the core imports no extension: `tests/test_house.py` checks this, and
`docs/rooms_picture.py` draws it.
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
    """Return the Python files of a room or an extension, including those in its subfolders, sorted."""
    return sorted((PACKAGE / room).rglob("*.py"))


@cache
def rooms_imported(path: Path) -> frozenset[str]:
    """Return the rooms and extensions from which a file imports, including its own if it imports
    from there.

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
    own = [part[1:] for part in parts if part[0] == PACKAGE.name and len(part) > 1]
    extensions = {
        f"extensions/{part[1]}" for part in own if part[0] == "extensions" and len(part) > 1
    }
    return frozenset(part[0] for part in own if part[0] in ROOMS) | extensions


def purpose(path: Path) -> str:
    """Return the first paragraph of a file's docstring on one line, without its full stop."""
    docstring = ast.get_docstring(ast.parse(path.read_text())) or ""
    paragraph = docstring.partition("\n\n")[0]
    return " ".join(paragraph.split()).rstrip(".")
