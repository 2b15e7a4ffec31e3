"""The source files that a module uses: its transitive imports, found by static analysis.

The workflow declares them as inputs of each stage, so editing a module re-runs the stages that use
it.
"""

import ast
import functools
import importlib.util
from collections.abc import Iterable, Iterator
from pathlib import Path

from lowalt.config.extensions import offered
from lowalt.spectra.catalogue import module_name

PACKAGE = Path(__file__).parents[1]
ROOT = PACKAGE.parent
CATALOGUE = "lowalt.spectra.catalogue"
"""The module that imports spectra by name, so that a new file in their folder changes no other."""
EXTENSIONS = "lowalt.config.extensions"
"""The module that finds extensions by their entry points."""
DECLARATION = "lowalt.extensions"
"""The entry point of the package's own extensions, which that module imports."""
MESHES = "lowalt.targets.mesh_files"
"""The module that imports the readers of extensions by name."""


@functools.cache
def _file(module: str) -> Path | None:
    """File of a module of the package or of an extension, None where there is none."""
    if module.split(".")[0] != PACKAGE.name:
        found = importlib.util.find_spec(module)
        origin = found.origin if found else None
        if origin is None or not origin.endswith(".py"):
            return None
        return Path(origin)
    base = ROOT.joinpath(*module.split("."))
    for path in (base / "__init__.py", base.with_suffix(".py")):
        if path.is_file():
            return path
    return None


def _statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield every statement of a body and of the blocks inside it.

    Expressions, which are most nodes, contain none.
    """
    for statement in body:
        yield statement
        for name in ("body", "orelse", "finalbody"):
            yield from _statements(getattr(statement, name, []))
        for block in (*getattr(statement, "handlers", []), *getattr(statement, "cases", [])):
            yield from _statements(block.body)


@functools.cache
def _imports(path: Path, package: str = PACKAGE.name) -> tuple[str, ...]:
    """Modules of lowalt, and of the file's own `package`, that a file imports.

    They may stand anywhere in the file, but in a `__main__` only at top level. Imports within a
    function of a `__main__` belong to one subcommand; the caller names them. Those within functions
    of the package's `__init__` serve users' attribute access, which no stage uses.
    """
    tree = ast.parse(path.read_bytes(), str(path))
    modules = []
    statements: Iterable[ast.stmt] = _statements(tree.body)
    if path.name == "__main__.py" or path == PACKAGE / "__init__.py":
        statements = tree.body
    for node in statements:
        if isinstance(node, ast.Import):
            modules += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(
        name for name in modules if name.split(".")[0] in (PACKAGE.name, package) and _file(name)
    )


@functools.cache
def sources(*modules: str, spectra: tuple[str, ...] = ()) -> tuple[Path, ...]:
    """Return the package's files that running `python -m` on these modules can import, sorted.

    modules: as on the command line, then the modules that the subcommand in question imports by
    itself, and paths of the user's own effects; spectra: those that the configuration names, whose
    modules the catalogue of spectra imports by name.
    Raises: ModuleNotFoundError where there is no such module.
    """
    todo: list[str] = []
    seen: set[str] = set()
    paths = [Path(name) for name in modules if name.endswith(".py")]
    for path in paths:
        todo += _imports(path)
    for module in modules:
        if module.endswith(".py"):
            continue
        if _file(module) is None:
            raise ModuleNotFoundError(module)
        todo.append(module)
        if _file(f"{module}.__main__"):
            todo.append(f"{module}.__main__")
    while todo:
        name = todo.pop()
        if name in seen:
            continue
        seen.add(name)
        package = name.split(".")[0]
        parent = name.rpartition(".")[0]
        if parent and package == PACKAGE.name:
            todo.append(parent)
        todo += _imports(file_of(name), package)
        if name == CATALOGUE:
            todo += [module_name(spectrum) for spectrum in spectra]
        # A core without its folder of extensions declares none.
        if name == EXTENSIONS and _file(DECLARATION):
            todo.append(DECLARATION)
        if name == MESHES:
            todo += offered("meshes").values()
    return tuple(sorted({*map(file_of, seen), *(path.absolute() for path in paths)}))


def file_of(module: str) -> Path:
    """Return the file of a module. Raises: ModuleNotFoundError where there is no such module."""
    path = _file(module)
    if path is None:
        raise ModuleNotFoundError(module)
    return path


def near(path: Path) -> str:
    """Return a path relative to the working directory if it is below, so a checkout can move."""
    if path.is_relative_to(Path.cwd()):
        return str(path.relative_to(Path.cwd()))
    return str(path)


@functools.cache
def code(*modules: str, spectra: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return `sources` of these modules as inputs of a rule, whose jobs an edit re-runs."""
    return tuple(near(path) for path in sources(*modules, spectra=spectra))
