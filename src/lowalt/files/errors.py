"""The exceptions for bad input, whose messages name the file, key or value and the expected one."""

import difflib
import re
import shlex
import sys
import traceback
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType


def instead(unknown: Iterable[object], known: Iterable[str], otherwise: str = "") -> str:
    """Return in words what was expected instead of unknown names.

    These are the known names that are similar to an unknown one. If none is similar, it is the text
    `otherwise` or, without such a text, all known names.
    """
    known = list(known)
    similar: list[str] = []
    for name in unknown:
        nearest = difflib.get_close_matches(str(name), known, n=1)
        similar += [match for match in nearest if match not in similar]
    if similar:
        return f"perhaps {similar}"
    return otherwise or f"only {known}"


LONGEST = 400
"""Largest number of characters in an error message, whatever a file contains."""
LONGEST_VALUE = LONGEST // 2
"""Largest number of characters of one value, or of a library's message, within such a message."""
_GAP = " ... "


def shortened(text: str, longest: int = LONGEST) -> str:
    """Return a text of at most `longest` characters, with its middle cut out.

    The start tells where a fault is, the end what was expected.
    """
    if len(text) <= longest:
        return text
    start = 2 * longest // 3
    end = longest - start - len(_GAP)
    return f"{text[:start]}{_GAP}{text[-end:]}"


def in_plain_characters(text: str) -> str:
    """Return a text with escapes such as \\x1b instead of characters that a terminal obeys.

    Line ends and tabs stay as they are.
    """
    if text.isprintable():
        return text
    shown_characters = []
    for character in text:
        if not character.isprintable() and character not in "\n\t":
            character = character.encode("unicode_escape").decode()
        shown_characters.append(character)
    return "".join(shown_characters)


def shown(value: object) -> str:
    """Return a value of a file as text of at most LONGEST_VALUE characters."""
    try:
        return shortened(repr(value), LONGEST_VALUE)
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


def _packages_of_extras() -> Iterator[tuple[str, str]]:
    """Yield each package that an extra of this package asks for, and the name of the extra.

    The package is written as pip takes it, such as "snakemake>=9.23".
    """
    from importlib.metadata import requires  # takes 30 ms, which no other call should pay

    for requirement in requires("lowalt") or ():
        package, _, condition = requirement.partition(";")
        extra = re.search(r"extra == .([\w-]+)", condition)
        if extra:
            yield package.strip(), extra[1]


def install_command(extra: str) -> str:
    """Return the command that installs the packages of an extra of this package.

    It holds in a checkout and beside a wheel. It names the packages of others and never
    `lowalt[extra]`: no index holds that name, so whoever registered it could run code on the user's
    machine.
    """
    wanted = [package for package, its_extra in _packages_of_extras() if its_extra == extra]
    return f"pip install {shlex.join(wanted)}"


def missing_package(error: ImportError) -> InputError:
    """Return the error that names a missing package and the command that installs it.

    Raises: the given error unchanged if no extra of this package contains the missing one.
    """
    name = (error.name or "").partition(".")[0]
    for package, extra in _packages_of_extras():
        # The extra `test` repeats packages that a user needs from the extras of their purpose.
        if extra == "test":
            continue
        distribution = re.match(r"[\w-]+", package)
        if distribution and distribution[0].replace("-", "_") == name:
            return InputError(
                f"the package {name} is not installed, expected `{install_command(extra)}`"
            )
    raise error


@contextmanager
def reading(path: str | Path, kind: str) -> Iterator[None]:
    """Turn any exception of a reader into an InputError that names the file.

    Any exception, because libraries raise many types for a faulty file.
    Raises: InputError with the reader's own message if it raised one, otherwise one which says that
    the file is not a readable `kind`.
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


@contextmanager
def running(code: str, file: str = "") -> Iterator[None]:
    """Turn any error of code from elsewhere, also its call of `sys.exit`, into one sentence.

    code: how the sentence names it; file: its path, whose line the sentence names too. Raises:
    InputError, the code's own if it raised one.
    """
    try:
        yield
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        steps = traceback.extract_tb(error.__traceback__)
        lines = [step.lineno for step in steps if step.filename == file]
        if lines:
            code += f", line {lines[-1]}"
        raise InputError(f"{code}: {type(error).__name__}: {in_one_line(error)}") from error


def in_one_line(error: BaseException) -> str:
    """Return what a library's error says, as one line of bounded length."""
    return " ".join(str(error).split())[:LONGEST_VALUE]


class InputWarning(UserWarning):
    """The user's input looks wrong but is used unchanged; the message says what and where."""


def _is_inside_package(frame: FrameType) -> bool:
    """Return whether a frame runs code of this package, or of contextlib, which stands between."""
    module = frame.f_globals.get("__name__", "")
    return module.partition(".")[0] in (__name__.partition(".")[0], "contextlib")


def warn(text: str) -> None:
    """Warn with `InputWarning` at the line outside this package that called it."""
    level = 1
    frame = sys._getframe()
    while frame.f_back and _is_inside_package(frame):
        level = level + 1
        frame = frame.f_back
    warnings.warn(in_plain_characters(text), InputWarning, stacklevel=level)
