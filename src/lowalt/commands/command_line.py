"""What all commands share: their entry in the parser, and their answer as text or JSON."""

import argparse
import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.commands.command_table import COMMANDS


class Answer(NamedTuple):
    """The answer of a command: `facts` as JSON for programs, `text` for users, exit status."""

    facts: object
    text: str
    status: int = 0


def add_command(
    commands: argparse._SubParsersAction,
    name: str,
    act: Callable[[argparse.Namespace], Answer],
    meaning: str = "",
    example: str = "",
) -> argparse.ArgumentParser:
    """Add a command to a parser and return its own parser, with the option `--json`.

    act: function called with its options; meaning, example: its help, by default that of the table
    of commands.
    """
    if not meaning:
        _, meaning, example = COMMANDS[name]
    line = commands.add_parser(name, help=meaning, epilog=f"example: {example}")
    line.add_argument("--json", action="store_true", help="print JSON for a program")
    line.set_defaults(act=act)
    return line


def add_group(commands: argparse._SubParsersAction, name: str) -> argparse._SubParsersAction:
    """Add a command that has commands of its own, and return these."""
    _, meaning, example = COMMANDS[name]
    line = commands.add_parser(name, help=meaning, epilog=f"example: {example}")
    return line.add_subparsers(metavar="COMMAND", required=True)


def positive(limit: float, expected: str) -> Callable[[str], float]:
    """Return the type of an option that is a number between 0 and a limit.

    expected: what the refusal of another text asks for.
    """

    def number(text: str) -> float:
        """The number. Raises: ArgumentTypeError for any other text."""
        try:
            value = float(text)
        except ValueError:
            value = 0.0
        if not 0 < value < limit:
            raise argparse.ArgumentTypeError(f"{text!r}, expected {expected}")
        return value

    return number


def _plain(value: object) -> object:
    """Convert a value to JSON types: NaN becomes null, an infinity "inf" or "-inf"."""
    if dataclasses.is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and math.isnan(value):
        return None
    if isinstance(value, float) and math.isinf(value):
        return str(value)
    return value


def as_json(facts: object) -> str:
    """Return facts as one JSON text.

    facts: nested mappings, sequences, dataclasses, arrays, paths, texts and numbers. NaN becomes
    null and an infinity "inf" or "-inf", since JSON has neither. Raises: TypeError for a value of
    any other type.
    """
    return json.dumps(_plain(facts), indent=1, allow_nan=False)
