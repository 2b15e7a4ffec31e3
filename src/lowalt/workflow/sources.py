"""The source files that a module uses: its transitive imports within the package, found by static analysis.

The workflow declares them as inputs of each stage, so editing a module re-runs the stages that use it.
"""

import ast
import functools
import importlib.util
from collections.abc import Iterator
from pathlib import Path

from lowalt.spectra.catalogue import module_name

PACKAGE = Path(__file__).parents[1]
ROOT = PACKAGE.parent
CATALOGUE = "lowalt.spectra.catalogue"
"""The module that imports spectra by name, so that a new file in their folder changes no other."""


@functools.cache
def _file(module: str) -> Path | None:
    """File of a module of the package or of an extension, None where there is none."""
    if module.split(".")[0] != PACKAGE.name:
        found = importlib.util.find_spec(module)
        return Path(found.origin) if found and found.origin and found.origin.endswith(".py") else None
    base = ROOT.joinpath(*module.split("."))
    for path in (base / "__init__.py", base.with_suffix(".py")):
        if path.is_file():
            return path
    return None


def _statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield every statement of a body and of the blocks inside it. Expressions, which are most nodes, contain none."""
    for statement in body:
        yield statement
        for name in ("body", "orelse", "finalbody"):
            yield from _statements(getattr(statement, name, []))
        for block in (*getattr(statement, "handlers", []), *getattr(statement, "cases", [])):
            yield from _statements(block.body)


@functools.cache
def _imports(path: Path, package: str = PACKAGE.name) -> tuple[str, ...]:
    """Modules of lowalt, and of the file's own `package`, that a file imports: anywhere in the file,
    but in a `__main__` only at top level.

    Imports within a function of a `__main__` belong to one subcommand; the caller names them. Those within functions of
    the package's `__init__` serve users' attribute access, which no stage uses.
    """
    tree = ast.parse(path.read_bytes(), str(path))
    modules = []
    deferred = path.name == "__main__.py" or path == PACKAGE / "__init__.py"
    for node in tree.body if deferred else _statements(tree.body):
        if isinstance(node, ast.Import):
            modules += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(name for name in modules if name.split(".")[0] in (PACKAGE.name, package) and _file(name))


@functools.cache
def sources(*modules: str, spectra: tuple[str, ...] = ()) -> tuple[Path, ...]:
    """Return the package's files that running `python -m` on these modules can import, sorted.

    modules: as on the command line, then the modules that the subcommand in question imports by itself, and paths of
    the user's own effects; spectra: those that the configuration names, whose modules the catalogue of spectra imports
    by name.
    Raises: ModuleNotFoundError where there is no such module.
    """
    todo, seen, paths = [], set(), [Path(name) for name in modules if name.endswith(".py")]
    for path in paths:
        todo += _imports(path)
    for module in filter(lambda name: not name.endswith(".py"), modules):
        if _file(module) is None:
            raise ModuleNotFoundError(module)
        todo += [module, *([f"{module}.__main__"] if _file(f"{module}.__main__") else [])]
    while todo:
        name = todo.pop()
        if name not in seen:
            seen.add(name)
            parent = name.rpartition(".")[0]
            own = name.split(".")[0] == PACKAGE.name
            todo += [*([parent] if parent and own else []), *_imports(_file(name), name.split(".")[0])]
            if name == CATALOGUE:
                todo += [module_name(spectrum) for spectrum in spectra]
    return tuple(sorted({*map(_file, seen), *(path.absolute() for path in paths)}))


def near(path: Path) -> str:
    """Return a path relative to the working directory if it is below it, so that a checkout can be moved."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)


@functools.cache
def code(*modules: str, spectra: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return `sources` of these modules as inputs of a rule: editing one re-runs the rule's jobs."""
    return tuple(near(path) for path in sources(*modules, spectra=spectra))
