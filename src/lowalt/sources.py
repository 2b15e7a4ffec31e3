"""Which source files a module runs: its transitive imports inside the package, read from the syntax tree.

The workflow declares them as inputs of each stage, so editing a module re-runs the stages that use it.
"""

import ast
import functools
from pathlib import Path

PACKAGE = Path(__file__).parent
ROOT = PACKAGE.parent


def _file(module: str) -> Path | None:
    base = ROOT.joinpath(*module.split("."))
    for path in (base / "__init__.py", base.with_suffix(".py")):
        if path.is_file():
            return path
    return None


@functools.cache
def _imports(path: Path) -> tuple[str, ...]:
    """Modules of the package that one file names in an import, anywhere in it."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(), str(path))):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            found += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(name for name in found if name.split(".")[0] == PACKAGE.name and _file(name))


@functools.cache
def sources(module: str) -> tuple[Path, ...]:
    """Return the files that `python -m {module}` can import from this package, sorted; `module` as on the command line.

    Imports inside functions count: what may run is what a change of must re-run.
    Raises: ModuleNotFoundError where there is no such module.
    """
    if _file(module) is None:
        raise ModuleNotFoundError(module)
    todo, seen = [module], set()
    if _file(f"{module}.__main__"):
        todo.append(f"{module}.__main__")
    while todo:
        name = todo.pop()
        if name in seen:
            continue
        seen.add(name)
        todo += name.rpartition(".")[:1] if "." in name else []
        todo += _imports(_file(name))
    return tuple(sorted({_file(name) for name in seen}))
