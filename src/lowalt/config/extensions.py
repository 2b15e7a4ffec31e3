"""The interface of extensions: what a package adds to lowalt, and how what is installed is found.

An extension is a Python package with an entry point of the group `lowalt.extensions`, whose value
is an `Extension`. It names modules as texts, so that finding it imports none of them; a module is
imported when something of it is used. The core imports no extension, and the extensions that come
with lowalt are found as any other is.
"""

import functools
import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from importlib.metadata import EntryPoint, entry_points
from types import ModuleType
from typing import Any, NamedTuple

import lowalt
from lowalt.config.core_commands import CORE_COMMANDS, Command
from lowalt.files.errors import InputError, running, shown
from lowalt.files.package_plan import PACKAGE

GROUP = "lowalt.extensions"
"""The group of entry points."""


class AddedEffect(NamedTuple):
    """An effect: its module, which keeps `lowalt.scene.contract`, and its place in the chain.

    after: the effect of the same place behind which it acts; by default it acts behind all of its
    place.
    """

    module: str
    place: str
    after: str = ""


@dataclass(frozen=True)
class Extension:
    """What an extension adds: mappings from names to modules, all of them empty by default.

    A suffix that the core reads or writes itself remains the core's.
    """

    commands: Mapping[str, Command] = field(default_factory=dict)
    """Of `lowalt NAME`."""
    effects: Mapping[str, AddedEffect] = field(default_factory=dict)
    """Of the block `effects`."""
    spectra: Mapping[str, str] = field(default_factory=dict)
    """Of the block `spectra`: modules that keep `lowalt.spectra.interface`."""
    functions: Mapping[str, str] = field(default_factory=dict)
    """That programs call as `lowalt.NAME`: modules that offer a function of this name."""
    meshes: Mapping[str, str] = field(default_factory=dict)
    """Formats of targets' meshes by suffix: modules that offer `pieces(path)` and, where the format
    states them, METRES of its unit and its axis UP."""
    readers: Mapping[str, str] = field(default_factory=dict)
    """Of inputs of `lowalt predict` by suffix: modules that offer `read(path)` and `answer(model,
    settings, content, name)`."""
    stores: Mapping[str, str] = field(default_factory=dict)
    """Of data sets by the scheme of their addresses, such as https: modules that offer `span`,
    `beside` and `fetched` as `lowalt.extensions.formats.web_files` does."""
    models: Mapping[str, str] = field(default_factory=dict)
    """Collections of trained models: modules that offer `names()` and `path_of(name)`."""
    exports: Mapping[str, str] = field(default_factory=dict)
    """Formats of trained models by suffix: modules that offer `export(trained, out)`."""
    comparisons: Mapping[str, str] = field(default_factory=dict)
    """What `lowalt compare` takes besides runs: modules that offer `compared_named(first,
    second)`."""
    sections: Mapping[str, str] = field(default_factory=dict)
    """Sections of the report: modules that offer `values(run)` and have a template of the same name
    in their folder, by the file of the report's manifest that a run must have for the section."""


KINDS: dict[str, type] = dict.fromkeys((one.name for one in fields(Extension)), str)
KINDS |= {"commands": Command, "effects": AddedEffect}
"""Type of what an extension offers under a name, by the fields of `Extension`."""


class Installed(NamedTuple):
    """The extensions of this installation and their packages by name; a sentence per faulty one."""

    extensions: dict[str, Extension]
    packages: dict[str, str]
    faults: list[str]


def _package(point: EntryPoint) -> str:
    """The name of the package that brings an extension."""
    if point.dist is None:
        return "an unknown package"
    return point.dist.name


def _label(point: EntryPoint) -> str:
    """How sentences call an extension: its name and the package that brings it."""
    return f"extension {point.name!r} of the package {_package(point)!r}"


def _loaded(point: EntryPoint) -> Extension:
    """The extension of an entry point.

    Raises: InputError naming it where it cannot be imported or is none.
    """
    with running(_label(point)):
        extension = point.load()
    if not isinstance(extension, Extension):
        raise InputError(
            f"{_label(point)}: {point.value} is {shown(extension)}, expected an Extension"
        )
    for kind, wanted in KINDS.items():
        offered = getattr(extension, kind)
        if not isinstance(offered, Mapping):
            raise InputError(
                f"{_label(point)}: {kind} is {shown(offered)}, expected names to modules"
            )
        for name, value in offered.items():
            if not isinstance(name, str) or not isinstance(value, wanted):
                raise InputError(
                    f"{_label(point)}: {kind} {name!r} is {shown(value)}, "
                    f"expected a {wanted.__name__}"
                )
    return extension


def _core_names() -> dict[str, set[str]]:
    """The names that the core has, by the fields of `Extension` that could take one of them."""
    effects = {path.stem for path in PACKAGE.glob("scene/effects/*/*.py")}
    spectra = {path.stem for path in PACKAGE.glob("spectra/kinds/*.py")}
    rooms = {path.stem for path in PACKAGE.iterdir()}
    return {
        "commands": {*CORE_COMMANDS},
        "effects": effects,
        "spectra": spectra,
        "functions": {*lowalt.__all__, *rooms},
    }


def _taken(extension: Extension, others: dict[str, Extension]) -> str:
    """Say what an extension offers under a name that is taken; "" where all its names are free."""
    core = _core_names()
    for kind in KINDS:
        owners = {name: "lowalt's own" for name in core.get(kind, ())}
        for other, held in others.items():
            owners |= {name: f"the extension {other!r}'s" for name in getattr(held, kind)}
        for name in getattr(extension, kind):
            if name in owners:
                return f"{kind} {name!r} is {owners[name]} already, expected another name"
    return ""


@functools.cache
def found() -> Installed:
    """Return the extensions that are installed, read once per process.

    A faulty one is left out whole. Those of lowalt's own package come first, the others in the
    order of their packages and names.
    """
    extensions: dict[str, Extension] = {}
    packages: dict[str, str] = {}
    faults: list[str] = []

    def order(point: EntryPoint) -> tuple[bool, str, str]:
        """Own extensions first, so that a stranger's cannot take their names."""
        package = _package(point)
        return package != "lowalt", package, point.name

    for point in sorted(entry_points(group=GROUP), key=order):
        try:
            extension = _loaded(point)
        except InputError as error:
            faults.append(str(error))
            continue
        taken = _taken(extension, extensions)
        if point.name in extensions:
            taken = "another extension has its name, expected another one"
        if taken:
            faults.append(f"{_label(point)}: {taken}")
            continue
        extensions[point.name] = extension
        packages[point.name] = _package(point)
    return Installed(extensions, packages, faults)


def offered(kind: str) -> dict[str, Any]:
    """Return what all extensions offer under a field of `Extension`, by name."""
    together: dict[str, Any] = {}
    for extension in found().extensions.values():
        together |= getattr(extension, kind)
    return together


def owner(kind: str, name: str) -> str:
    """Return the name of the extension that offers `name`, "" where none does."""
    for own_name, extension in found().extensions.items():
        if name in getattr(extension, kind):
            return own_name
    return ""


def module_offered(kind: str, name: str, module: str) -> ModuleType:
    """Return the module of what an extension offers, imported.

    Raises: InputError naming the extension where the import ends in an error other than a missing
    package.
    """
    with running(f"extension {owner(kind, name)!r}: {kind} {name!r}"):
        return importlib.import_module(module)


def function_offered(kind: str, name: str, module: str, function: str) -> Callable[..., Any]:
    """Return a function of a module of an extension.

    Raises: InputError where it has none of this name.
    """
    loaded = module_offered(kind, name, module)
    if not callable(getattr(loaded, function, None)):
        raise InputError(
            f"extension {owner(kind, name)!r}: {module} has no function {function!r}, expected one"
        )
    return getattr(loaded, function)


def extensions_in_words() -> str:
    """Return a line per extension: name, package and what it adds; then a sentence per fault."""
    installed = found()
    lines = []
    if installed.extensions:
        lines.append("extensions:")
    for name, extension in installed.extensions.items():
        added = []
        for kind in KINDS:
            names = getattr(extension, kind)
            if names:
                added.append(f"{kind} {', '.join(names)}")
        lines.append(f"  {name} (package {installed.packages[name]}): {'; '.join(added)}")
    lines += [f"left out: {fault}" for fault in installed.faults]
    return "\n".join(lines)
