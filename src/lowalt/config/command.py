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
    missing_package,
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


def add_backbone_option(parser: argparse.ArgumentParser) -> None:
    """Add the option with which the user names the code of a model's backbone.

    The model's own file may not choose it, because a stranger's file could then run any code.
    """
    parser.add_argument(
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


PATH_ERRORS = (
    errno.EROFS,
    errno.EACCES,
    errno.EPERM,
    errno.ENOTDIR,
    errno.EISDIR,
    errno.EEXIST,
    errno.ENAMETOOLONG,
)
"""Operating system errors caused by a path of the user, such as a read-only folder."""


USER_ERRORS = (InputError, OSError, ImportError, MemoryError)
"""Types of errors that the user can cause and mend; `error_sentence` has a sentence for most."""


def error_sentence(error: InputError | OSError | ImportError | MemoryError) -> str:
    """Return one sentence of bounded length for an error that the user can mend.

    Such are an InputError, a path that the operating system refuses, a full disk or output, too
    little memory, and a package that is not installed.
    Raises: any other error of these types unchanged.
    """
    if isinstance(error, MemoryError):
        return f"memory: not enough ({in_one_line(error)}), expected more of it, or a smaller input"
    if isinstance(error, OSError) and error.errno in FULL:
        return f"{error.filename or 'standard output'}: {error.strerror}, expected room to write"
    if isinstance(error, InputError):
        return str(error)
    if isinstance(error, ImportError):
        return str(missing_package(error))
    if error.errno not in PATH_ERRORS or error.filename is None:
        raise error
    sentence = (
        f"{error.filename}: {error.strerror}, expected a file or folder that this user may read "
        "or write"
    )
    return shortened(in_plain_characters(sentence))


def drop_output() -> None:
    """Discard what is still to be written on standard output.

    Python would try to write it again when it ends, and fail again.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextlib.contextmanager
def user_errors_in_one_line() -> Iterator[None]:
    """Print an error that the user can mend as one line, and exit with status 2.

    Raises: SystemExit after that line; any other error unchanged.
    """
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except USER_ERRORS as error:
        if isinstance(error, OSError) and error.errno in FULL:
            drop_output()
        print(f"error: {error_sentence(error)}", file=sys.stderr)
        raise SystemExit(2) from None


class UserErrorsInOneLine:
    """Wraps an object whose methods then handle errors as `user_errors_in_one_line` does.

    Snakemake calls the methods of stages itself and would print tracebacks.
    """

    def __init__(self, wrapped: object) -> None:
        """Take the object."""
        self._wrapped = wrapped

    def __getattr__(self, name: str) -> Any:
        member = getattr(self._wrapped, name)
        if not callable(member):
            return member

        @functools.wraps(member)
        def method(*arguments: Any, **named: Any) -> Any:
            """Return the method's result, or exit after one line."""
            with user_errors_in_one_line():
                return member(*arguments, **named)

        return method


USUAL_FORMAT = warnings.formatwarning


def warn_in_one_line() -> None:
    """Print each InputWarning as one line, without the line of source that it comes from.

    Warnings of libraries are not printed, unless `python -W` or PYTHONWARNINGS asks for warnings.
    """
    if not sys.warnoptions:
        # Otherwise a library's warnings about a file would stand in front of the sentence about it.
        warnings.simplefilter("ignore")
        warnings.simplefilter("default", InputWarning)

    def formatted(message: Any, category: Any, *where: Any, **more: Any) -> str:
        """Return the text of a warning."""
        if issubclass(category, InputWarning):
            return f"warning: {message}\n"
        return USUAL_FORMAT(message, category, *where, **more)

    warnings.formatwarning = formatted


def run(main: Callable[[list[str]], None]) -> None:
    """Run a stage's `main` on the process's arguments; errors and warnings become one line."""
    end_with_starter()
    # Most stages free and allocate arrays of the same sizes for each sample.
    keep_freed_memory()
    warn_in_one_line()
    with user_errors_in_one_line():
        main(sys.argv[1:])
    # ru_maxrss includes short peaks that sampling misses; it is in KiB on Linux.
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    # `python -m lowalt.STAGE` starts the file lowalt/STAGE/__main__.py.
    stage = Path(sys.argv[0]).parent.name
    print(f"{stage}: done, peak memory {peak:.0f} MiB", file=sys.stderr)
