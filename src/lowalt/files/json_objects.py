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


MOST_VALUES = 4_000_000
"""Largest number of values of a text: each takes up to a few hundred bytes of memory."""
MOST_BITS = 64


def _whole(text: str) -> int:
    """Return the number in a text. Raises: ValueError for one of more than MOST_BITS bits, which no
    setting has and which arithmetic in float64 does not take.
    """
    value = int(text)
    if value.bit_length() > MOST_BITS:
        raise ValueError(f"a whole number of {len(text)} digits, expected at most {MOST_BITS} bits")
    return value


def json_object(text: str, where: str | Path, what: str) -> dict:
    """Return the object in a JSON text; what: the text in words, for messages.

    Raises: InputError naming `where` for another text or value, a number that is not finite or has
    more than 64 bits, values that are nested too deeply, or more than MOST_VALUES of them.
    """
    # Counted before they are made; a comma or bracket inside a string counts as well.
    if sum(map(text.count, "[{,")) > MOST_VALUES:
        raise InputError(f"{where}: more than {MOST_VALUES} values, expected {what} with fewer")
    try:
        value = json.loads(text, parse_constant=_no_number, parse_float=_finite, parse_int=_whole)
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
