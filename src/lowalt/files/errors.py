"""The exceptions for bad input, whose messages name the file, key or value and the expected one."""

import difflib
import re
import shlex
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path


def instead(unknown: Iterable[object], known: Iterable[str], otherwise: str = "") -> str:
    """Return what was expected instead of unknown names, in words.

    These are the similar ones among the known names, else `otherwise`, else all known names.
    """
    known = list(known)
    near: dict[str, None] = {}
    for name in unknown:
        near |= dict.fromkeys(difflib.get_close_matches(str(name), known, 1))
    if near:
        return f"perhaps {list(near)}"
    return otherwise or f"only {known}"


LONGEST = 400
"""Largest number of characters in an error message, whatever a file contains."""


def shortened(text: str, longest: int = LONGEST) -> str:
    """Return a text of at most `longest` characters, with its middle cut out.

    The start tells where a fault is, the end what was expected.
    """
    if len(text) <= longest:
        return text
    start = 2 * longest // 3
    end = longest - start - len(" ... ")
    return f"{text[:start]} ... {text[-end:]}"


def in_plain_characters(text: str) -> str:
    """Return a text whose control characters, and others that a terminal obeys instead of showing,
    are written as escapes such as \\x1b; line ends and tabs stay.
    """
    if text.isprintable():
        return text
    return "".join(
        sign if sign.isprintable() or sign in "\n\t" else sign.encode("unicode_escape").decode()
        for sign in text
    )


def shown(value: object) -> str:
    """Return a value of a file as text of at most 200 characters."""
    try:
        return shortened(repr(value), LONGEST // 2)
    except (RecursionError, ValueError):
        # Values are nested too deeply, or a number has more than 4300 digits.
        return f"a {type(value).__name__} too large to show"


class InputError(ValueError):
    """Bad input from outside; the message says where it stands and what was expected instead.

    It has at most LONGEST characters, and no control character of a file reaches the terminal.
    """

    def __init__(self, message: str) -> None:
        """Take the message; its middle is cut out if it is too long."""
        super().__init__(shortened(in_plain_characters(shortened(message))))


class BelowFloor(InputError):
    """A tolerance smaller than the error bound that float64 arithmetic can prove for a sample."""


class SpaceError(InputError):
    """A disk or memory is too small; the message names the required and the free space."""


def install_command(extra: str) -> str:
    """Return the command that installs the packages of an extra of this package.

    It holds in a checkout and beside a wheel. It names the packages of others and never
    `lowalt[extra]`: no index holds that name, so whoever registered it could run code on the user's
    machine.
    """
    from importlib.metadata import requires  # takes 30 ms, which no other call should pay

    packages = []
    for requirement in requires("lowalt") or ():
        package, _, condition = requirement.partition(";")
        if re.search(rf"extra == .{extra}\b", condition):
            packages.append(shlex.quote(package.strip()))
    return f"pip install {' '.join(packages)}"


def lacking(error: ImportError) -> InputError:
    """Return the refusal of what needs a missing package, with the command that installs it.

    Raises: the error unchanged where no extra of this package names that one.
    """
    from importlib.metadata import requires  # takes 30 ms, which no other call should pay

    name = (error.name or "").partition(".")[0]
    for requirement in requires("lowalt") or ():
        found = re.match(r"([\w-]+).*extra == .(\w+)", requirement)
        if found and found[1].replace("-", "_") == name and found[2] != "test":
            return InputError(
                f"the package {name} is not installed, expected `{install_command(found[2])}`"
            )
    raise error


@contextmanager
def reading(path: str | Path, kind: str) -> Iterator[None]:
    """Turn any exception of a reader into an InputError that names the file.

    Libraries raise many types. Raises: InputError, the reader's own, or that the file is not a
    readable `kind`.
    """
    try:
        yield
    except InputError as error:
        message = str(error)
        if not message.startswith(str(path)):
            message = f"{path}: {message}"
        raise InputError(message) from None
    except Exception as error:
        raise InputError(
            f"{path}: not a readable {kind} ({type(error).__name__}: {error})"
        ) from None


def in_one_line(error: Exception) -> str:
    """Return what a library's error says, as one line of bounded length."""
    return " ".join(str(error).split())[:200]


class InputWarning(UserWarning):
    """The user's input looks wrong but is used unchanged; the message says what and where."""


def warn(text: str) -> None:
    """Warn with `InputWarning` at the line outside this package that called it."""
    level = 1
    frame = sys._getframe()
    package = __name__.partition(".")[0]
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] in (
        package,
        "contextlib",
    ):
        level = level + 1
        frame = frame.f_back
    warnings.warn(in_plain_characters(text), InputWarning, stacklevel=level)
