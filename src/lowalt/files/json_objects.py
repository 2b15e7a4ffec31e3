"""Strict reader of untrusted JSON objects (RFC 8259, limited nesting), which refuses the rest."""

import json
import math
from pathlib import Path
from typing import NoReturn

from lowalt.files.atomic import text_of
from lowalt.files.errors import InputError, in_one_line


def _no_number(text: str) -> NoReturn:
    """Refuse NaN and Infinity, which Python's reader accepts but JSON does not allow."""
    raise ValueError(f"{text} is no number of JSON")


def _finite(text: str) -> float:
    """Return the number in a text. Raises: ValueError for one beyond float64, such as 1e400."""
    value = float(text)
    if not math.isfinite(value):
        _no_number(text)
    return value


def json_object(text: str, where: str | Path, what: str) -> dict:
    """Return the object in a JSON text; what: the text in words, for messages.

    Raises: InputError naming `where` for another text or value, a number that is not finite, or
    values that are nested too deeply.
    """
    try:
        value = json.loads(text, parse_constant=_no_number, parse_float=_finite)
    except RecursionError:
        raise InputError(f"{where}: not {what} (values stand in each other too deeply)") from None
    except ValueError as error:
        raise InputError(
            f"{where}: not {what}, expected a JSON object ({in_one_line(error)})"
        ) from None
    if not isinstance(value, dict):
        raise InputError(f"{where}: not {what} ({type(value).__name__}, expected a JSON object)")
    return value


def read_object(path: str | Path, what: str) -> dict:
    """Return the object in a JSON file.

    Raises: InputError naming the file where it is missing, and as `json_object`.
    """
    return json_object(text_of(path, what), path, what)
