"""Settings against a JSON schema, one sentence a fault; and the schema of all settings that a file brings.

Numbers are finite and integers are written as such (no 8.0) and fit 64 bits; text that a pattern describes has no
control characters, so that it can be printed.
"""

import functools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema

from lowalt.files.errors import InputError, instead
from lowalt.files.shipped import SHIPPED
from lowalt.files.yaml_files import load_yaml

BROUGHT = Path(__file__).with_name("brought.schema.yaml")
LONGEST = 200
"""Characters of a value that a sentence shows."""


def _whole(checker: Any, value: object) -> bool:
    """Whether a value is an integer of 64 bits."""
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63


def _number(checker: Any, value: object) -> bool:
    """Whether a value is a finite number."""
    return _whole(checker, value) or (isinstance(value, float) and math.isfinite(value))


def _pattern(validator: Any, pattern: str, value: object, schema: dict) -> Iterator[jsonschema.ValidationError]:
    """Refuse text that has control characters or is not as the pattern says."""
    if isinstance(value, str) and any(ord(sign) < 32 or ord(sign) == 127 for sign in value):
        yield jsonschema.ValidationError("control characters")
    yield from jsonschema.Draft202012Validator.VALIDATORS["pattern"](validator, pattern, value, schema)


Validator = jsonschema.validators.extend(
    jsonschema.Draft202012Validator,
    {"pattern": _pattern},
    type_checker=jsonschema.Draft202012Validator.TYPE_CHECKER.redefine_many({"integer": _whole, "number": _number}),
)


COUNTS = ("minProperties", "maxProperties")
"""Rules of a schema on the number of a block's keys."""


def plain(value: object) -> object:
    """Return `value` with infinities and NaN as the texts "inf" and "nan", which JSON has not as numbers."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _shown(value: object) -> str:
    """A value as text of bounded length."""
    text = repr(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def _expected(error: Any) -> str:
    """Return the schema's expectation in words."""
    rule, wanted = error.validator, error.validator_value
    if rule == "oneOf":
        # A number out of its range is told that; anything else, which types there are.
        ranges = [choice for choice in error.context if choice.validator not in ("type", "const")]
        return _expected(ranges[0]) if ranges else " or ".join(str(one.get("const", one.get("type"))) for one in wanted)
    if rule == "dependentRequired":
        return " together with ".join(next([key, *others] for key, others in wanted.items() if key in error.instance))
    words = {
        "type": f"type {wanted}",
        "minimum": f"at least {wanted}",
        "maximum": f"at most {wanted}",
        "exclusiveMinimum": f"more than {wanted}",
        "exclusiveMaximum": f"less than {wanted}",
        "enum": f"one of {wanted}",
        "minItems": f"at least {wanted} item(s)",
        "maxItems": f"at most {wanted} items",
        "minProperties": f"at least {wanted} key(s)",
        "maxProperties": f"at most {wanted} key(s)",
        "uniqueItems": "every item once",
        "pattern": f"text like {wanted}",
        "not": f"none of {wanted.get('enum')}" if isinstance(wanted, dict) else "",
    }
    return words.get(str(rule), error.message if len(error.message) <= LONGEST else "another value")


def _fault(error: Any) -> str:
    """Return what is wrong with a value and what was expected."""
    if error.validator == "additionalProperties":
        known = sorted(error.schema.get("properties", {}))
        unknown = [name for name in error.instance if name not in known]
        return f"unknown key(s) {_shown(unknown)}, expected {instead(unknown, known)}"
    if error.validator == "required":
        return f"missing key(s) {[name for name in error.validator_value if name not in error.instance]}"
    meaning = error.schema.get("description", "") if isinstance(error.schema, dict) else ""
    return f"value {_shown(error.instance)}, expected {_expected(error)}" + f" ({meaning})" * bool(meaning)


def faults(settings: object, schema: dict, whole: str = "configuration") -> list[str]:
    """Return one line a fault of settings against a JSON schema: key, value and what was expected.

    whole: the word for all that is checked. Of the items of a list with the same fault, the first is named.
    """
    lines: dict[tuple, str] = {}
    errors = Validator(schema).iter_errors(plain(settings))
    for error in sorted(errors, key=lambda error: ([*map(str, error.absolute_path)], error.validator in COUNTS)):
        block = tuple(part for part in error.absolute_path if isinstance(part, str))
        # Of a block with another fault, the number of its keys says nothing more.
        if error.validator not in COUNTS or not any(other[:-1] == block for other in lines):
            key = ".".join(map(str, error.absolute_path)) or whole
            lines.setdefault((*block, error.validator), f"{key}: {_fault(error)}")
    return list(lines.values())


@functools.cache
def _brought() -> dict:
    """The schema of what files bring, with the configuration's own, from which it takes the blocks they share."""
    return {**load_yaml(BROUGHT)["$defs"], "config": load_yaml(SHIPPED / "workflow/schemas/config.schema.yaml")}


def check_brought(part: str, settings: object, where: str | Path) -> None:
    """Refuse settings that a file brings, before anything is made of them.

    part: a definition of `brought.schema.yaml`; where: the file.
    Raises: InputError naming the file, the first key that is wrong, its value and what was expected.
    """
    try:
        lines = faults(settings, {"$ref": f"#/$defs/{part}", "$defs": _brought()}, part)
    except RecursionError:
        raise InputError(f"{where}: values stand in each other too deeply, expected a few levels") from None
    if lines:
        raise InputError(f"{where}: {lines[0]}")
