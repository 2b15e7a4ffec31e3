"""An effect of the user's own: a Python file that an overlay names by its path.

Such an overlay has `effects: {path/to/rain.py: {...}}`.

The file keeps the contract of effects (`lowalt.scene.contract`); its place is that of the functions
that it offers, and it acts behind the shipped effects of that place. It runs with the rights of the
user, so an overlay alone may name it (`lowalt.config.named_code`).
"""

import functools
import inspect
import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from lowalt.config.schema import NUMBER
from lowalt.files.errors import InputError, running
from lowalt.scene.contract import OFFERS


def loaded(name: str) -> ModuleType:
    """Return the module of the effect's file, run once for each of its contents.

    Raises: InputError where there is no such file, it ends in an error, or it does not keep the
    contract.
    """
    path = Path(name)
    if not path.is_file():
        raise InputError(f"effects: no file {name!r}, expected the path of an effect's Python file")
    return _run(name, path.read_bytes())


@functools.lru_cache
def _run(name: str, source: bytes) -> ModuleType:
    """The module that a source (bytes) makes; it is not written as byte code beside the file."""
    module = ModuleType(f"lowalt_own_effect_{Path(name).stem}")
    module.__file__ = name
    with running(f"effects: {name}", name):
        exec(compile(source, name, "exec"), module.__dict__)
    kept_contract(name, module)
    for function in OFFERS:
        if callable(getattr(module, function, None)):
            setattr(module, function, _guarded(name, getattr(module, function)))
    return module


def _guarded(name: str, function: Callable) -> Callable:
    """A function of a user's own file whose errors are one sentence."""

    @functools.wraps(function)
    def called(*arguments: Any) -> Any:
        """The function itself, its errors as one sentence that names the file."""
        with running(f"effects: {name}", name):
            return function(*arguments)

    return called


def kept_contract(name: str, module: ModuleType) -> ModuleType:
    """Return the module of an effect from outside of the core.

    Raises: InputError where it breaks the contract.
    """
    defaults = getattr(module, "DEFAULTS", None)
    if not isinstance(defaults, dict) or not all(isinstance(key, str) for key in defaults):
        raise InputError(
            f"effects: {name}: DEFAULTS is {str(defaults)[:100]}, expected every parameter with "
            "its value"
        )
    if not isinstance(getattr(module, "SOURCE", None), str):
        raise InputError(
            f"effects: {name}: no SOURCE, expected a text that says where its law comes from"
        )
    named = getattr(module, "FILES", ())
    if not set(named) <= set(defaults):
        raise InputError(f"effects: {name}: FILES is {named}, expected names of DEFAULTS")
    place_of(name, module)
    return module


def place_of(name: str, module: ModuleType) -> str:
    """Return the place of an effect by the functions that it offers.

    Raises: InputError where it offers none, functions of several places, or one with other
    arguments.
    """
    offered = {
        function: getattr(module, function)
        for function in OFFERS
        if callable(getattr(module, function, None))
    }
    places = {OFFERS[function].place for function in offered} - {""}
    if len(places) > 1 or not offered:
        raise InputError(
            f"effects: {name}: offers {list(offered)}, expected functions of one place of "
            "lowalt.scene.contract"
        )
    for function, found in offered.items():
        takes = ("settings", *OFFERS[function].takes)
        if tuple(inspect.signature(found).parameters) != takes:
            raise InputError(
                f"effects: {name}: expected {function}({', '.join(takes)}), as "
                "lowalt.scene.contract says"
            )
    if not places:
        return "channel"
    return places.pop()


def _kind(value: object) -> str:
    """The type of a value as sentences name it."""
    for kinds, word in (
        (bool, "true or false"),
        ((int, float), "a number"),
        (str, "a text"),
        (list, "a list"),
        (dict, "a block"),
    ):
        if isinstance(value, kinds):
            return word
    return "null"


def checked(name: str, module: ModuleType, changed: dict) -> dict:
    """Return the settings of an effect whose values have the types of its DEFAULTS.

    A default of None takes any value.

    Raises: InputError naming the key and its value.
    """
    result = dict(module.DEFAULTS)
    for key, value in changed.items():
        default = module.DEFAULTS.get(key)
        expected = _kind(default)
        # YAML reads a number such as 1e3 as text.
        if expected == "a number" and isinstance(value, str) and NUMBER.fullmatch(value):
            value = float(value)
        finite = not isinstance(value, float) or math.isfinite(value)
        if default is not None and (_kind(value) != expected or not finite):
            if not finite:
                expected = "a finite number"
            raise InputError(
                f"effects.{name}.{key}: {str(value)[:100]!r}, expected {expected} as its default "
                f"{default!r}"
            )
        result[key] = value
    return result
