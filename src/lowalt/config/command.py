"""What the stages' command lines share: the settings argument, one-line errors, peak memory.

A stage's settings arrive as one JSON object: `--settings '{"...": ...}'` or `--settings
@file.json`. The workflow passes the object itself, so that Snakemake notices every change; users
usually pass a file.
"""

import argparse
import contextlib
import errno
import functools
import os
import resource
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from lowalt.files.atomic import FULL, text_of
from lowalt.files.errors import (
    InputError,
    InputWarning,
    in_one_line,
    in_plain_characters,
    lacking,
    shortened,
)
from lowalt.files.json_objects import json_object
from lowalt.machine.memory import keep_freed_memory
from lowalt.machine.run_pipe import end_with_starter


def exit_status(code: int) -> int:
    """Return the exit status of a process as a shell reports it.

    code: return code of `subprocess`, which is minus the number of the signal that ended the
    process; a shell reports 128 + the number.
    """
    if code >= 0:
        return code
    return 128 - code


def parser(module: str, description: str | None) -> argparse.ArgumentParser:
    """Return an argument parser for `python -m {module}` that already has `--settings`."""
    result = argparse.ArgumentParser(prog=f"python -m {module}", description=description)
    result.add_argument(
        "--settings", required=True, type=_argument, metavar="JSON|@FILE", help="settings object"
    )
    return result


def name_backbone(line: argparse.ArgumentParser) -> None:
    """Add the option for the code of a model's backbone, which the model's file may not choose."""
    line.add_argument(
        "--backbone",
        default="",
        metavar="FILE.py:FUNCTION",
        help="for a model on code of its maker's own: that code",
    )


def _argument(text: str) -> dict:
    """Return `settings` of the text; argparse would replace the message of its ValueError."""
    try:
        return settings(text)
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def settings(text: str) -> dict:
    """Return the settings object in `text`, a JSON object or `@` and the path of a file with one.

    JSON has no infinity: the string "inf" stands for it wherever a number is expected.
    Raises: InputError where the text is no JSON object.
    """
    source = text
    if text.startswith("@"):
        source = text_of(text[1:], "--settings")
    return json_object(source, f"--settings {text[:80]!r}", "settings")


def pick(block: dict, *keys: str) -> list:
    """Return the values of exactly these keys of a settings block, in order.

    Raises: InputError naming a missing or unknown key.
    """
    missing = [key for key in keys if key not in block]
    unknown = [key for key in block if key not in keys]
    if missing or unknown:
        raise InputError(
            f"settings: missing {missing}, unknown {unknown}, expected exactly {sorted(keys)}"
        )
    return [block[key] for key in keys]


def dispatch(
    module: str, commands: Mapping[str, Callable[[list[str]], None]], arguments: list[str]
) -> None:
    """Run the command that the first argument names, on the other arguments.

    Raises: InputError naming the module's commands where the first argument is none of them.
    """
    if not arguments or arguments[0] not in commands:
        raise InputError(f"{module}: {arguments[:1]}, expected one of {list(commands)}")
    commands[arguments[0]](arguments[1:])


REFUSED = (
    errno.EROFS,
    errno.EACCES,
    errno.EPERM,
    errno.ENOTDIR,
    errno.EISDIR,
    errno.EEXIST,
    errno.ENAMETOOLONG,
)
"""Operating system errors caused by a path of the user, such as a read-only folder."""


REFUSALS = (InputError, OSError, ImportError, MemoryError)
"""Errors that become one sentence, as far as `refusal` knows them."""


def refusal(error: InputError | OSError | ImportError | MemoryError) -> str:
    """Return the message of a refusal, of bounded length.

    It is that of an InputError, one about the path in an error of the operating system, about a
    full disk or output, about memory, or about a package that is not installed. Raises: any other
    error unchanged.
    """
    if isinstance(error, MemoryError):
        return f"memory: not enough ({in_one_line(error)}), expected more of it, or a smaller input"
    if isinstance(error, OSError) and error.errno in FULL:
        return f"{error.filename or 'standard output'}: {error.strerror}, expected room to write"
    if isinstance(error, InputError):
        return str(error)
    if isinstance(error, ImportError):
        return str(lacking(error))
    if error.errno not in REFUSED or error.filename is None:
        raise error
    refused = (
        f"{error.filename}: {error.strerror}, expected a file or folder that this user may read "
        "or write"
    )
    return shortened(in_plain_characters(refused))


def drop_output() -> None:
    """Let what is still to be written on standard output go nowhere: Python would try again when it
    ends.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextlib.contextmanager
def refusing() -> Iterator[None]:
    """Turn what `refusal` knows, such as an InputError or a full output, into a line and status 2."""
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except REFUSALS as error:
        if isinstance(error, OSError) and error.errno in FULL:
            drop_output()
        print(f"error: {refusal(error)}", file=sys.stderr)
        raise SystemExit(2) from None


class Refusing:
    """Wraps an object whose methods then handle errors as `refusing` does.

    Snakemake would print tracebacks.
    """

    def __init__(self, held: object) -> None:
        """Take the object."""
        self._held = held

    def __getattr__(self, name: str) -> Any:
        held = getattr(self._held, name)
        if not callable(held):
            return held

        @functools.wraps(held)
        def asked(*given: Any, **named: Any) -> Any:
            """Return the method's result, or exit after one line."""
            with refusing():
                return held(*given, **named)

        return asked


USUAL_FORMAT = warnings.formatwarning


def warn_in_one_line() -> None:
    """Print each InputWarning as one line, without the line of source that it comes from.

    Warnings of libraries are not printed, unless `python -W` or PYTHONWARNINGS asks for warnings.
    """
    if not sys.warnoptions:
        # What a library finds odd in a file stands in front of the sentence that says it.
        warnings.simplefilter("ignore")
        warnings.simplefilter("default", InputWarning)

    def in_one_line(message: Any, category: Any, *where: Any, **more: Any) -> str:
        """The text of a warning."""
        if issubclass(category, InputWarning):
            return f"warning: {message}\n"
        return USUAL_FORMAT(message, category, *where, **more)

    warnings.formatwarning = in_one_line


def run(main: Callable[[list[str]], None]) -> None:
    """Run a stage's `main` on the process's arguments; errors and warnings become one line."""
    end_with_starter()
    keep_freed_memory()
    warn_in_one_line()
    with refusing():
        main(sys.argv[1:])
    # ru_maxrss includes short peaks that sampling misses; it is in KiB on Linux.
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{Path(sys.argv[0]).parent.name}: done, peak memory {peak:.0f} MiB", file=sys.stderr)
