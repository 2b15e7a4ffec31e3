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
from lowalt.files.errors import InputError, shown
from lowalt.files.package_plan import PACKAGE

GROUP = "lowalt.extensions"
"""The group of entry points."""


class AddedEffect(NamedTuple):
    """An effect: its module, which keeps `lowalt.scene.contract`, its place in the chain, and its
    order there.

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
    """Of the report, by the name of the file in its manifest without which the page has no such
    section: modules that offer `values(run)` beside a template of the same name."""


KINDS = {
    one.name: {"commands": Command, "effects": AddedEffect}.get(one.name, str)
    for one in fields(Extension)
}
"""Type of what an extension offers under a name, by the fields of `Extension`."""


class Installed(NamedTuple):
    """The extensions of this installation by their names, their packages, and a sentence for each
    left out.
    """

    extensions: dict[str, Extension]
    packages: dict[str, str]
    faults: list[str]


def _label(point: EntryPoint) -> str:
    """How sentences call an extension: its name and the package that brings it."""
    package = point.dist.name if point.dist else "an unknown package"
    return f"extension {point.name!r} of the package {package!r}"


def _loaded(point: EntryPoint) -> Extension:
    """The extension of an entry point. Raises: InputError naming it where it cannot be imported or
    is none.
    """
    try:
        extension = point.load()
    except Exception as error:
        raise InputError(f"{_label(point)}: {type(error).__name__}: {str(error)[:200]}") from error
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
                    f"{_label(point)}: {kind} {name!r} is {shown(value)}, expected a {wanted.__name__}"
                )
    return extension


def _core_names() -> dict[str, set[str]]:
    """The names that the core has, by the fields of `Extension` in which an extension could take
    one.
    """
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
    """Say what an extension offers under a name that the core or another one has; "" where all its
    names are free.
    """
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
    """Return the extensions that are installed, read once per process; a faulty one is left out
    whole.

    Those of lowalt's own package come first, the others in the order of their packages and names.
    """
    extensions: dict[str, Extension] = {}
    packages: dict[str, str] = {}
    faults: list[str] = []

    def order(point: EntryPoint) -> tuple[bool, str, str]:
        """Own extensions first, so that a stranger's cannot take their names."""
        package = point.dist.name if point.dist else ""
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
        packages[point.name] = point.dist.name if point.dist else "an unknown package"
    return Installed(extensions, packages, faults)


def offered(kind: str) -> dict[str, Any]:
    """Return what all extensions offer under a field of `Extension`, by name."""
    together: dict[str, Any] = {}
    for extension in found().extensions.values():
        together |= getattr(extension, kind)
    return together


def owner(kind: str, name: str) -> str:
    """Return the name of the extension that offers `name`, "" where none does."""
    return next((own for own, one in found().extensions.items() if name in getattr(one, kind)), "")


def module_offered(kind: str, name: str, module: str) -> ModuleType:
    """Return the module of what an extension offers, imported.

    Raises: InputError naming the extension where the import ends in an error other than a missing
    package.
    """
    try:
        return importlib.import_module(module)
    except InputError:
        raise
    except Exception as error:
        where = f"extension {owner(kind, name)!r}: {kind} {name!r}"
        raise InputError(f"{where}: {type(error).__name__}: {str(error)[:200]}") from error


def function_offered(kind: str, name: str, module: str, function: str) -> Callable[..., Any]:
    """Return a function of a module of an extension. Raises: InputError where it has none of this
    name.
    """
    loaded = module_offered(kind, name, module)
    if not callable(getattr(loaded, function, None)):
        raise InputError(
            f"extension {owner(kind, name)!r}: {module} has no function {function!r}, expected one"
        )
    return getattr(loaded, function)


def extensions_in_words() -> str:
    """Return a line for each extension: its name, its package, and what it adds; then a sentence
    for each fault.
    """
    lines = ["extensions:"] if found().extensions else []
    for name, extension in found().extensions.items():
        added = [
            f"{kind} {', '.join(getattr(extension, kind))}"
            for kind in KINDS
            if getattr(extension, kind)
        ]
        lines.append(f"  {name} (package {found().packages[name]}): {'; '.join(added)}")
    return "\n".join([*lines, *(f"left out: {fault}" for fault in found().faults)])
