"""Checks settings, also of untrusted files, against a JSON schema, with one sentence per fault.

Numbers are finite and integers are written as such (no 8.0) and fit 64 bits; `const: inf` also
accepts an infinity; text that a pattern describes has no control characters, so that it can be
printed. `ascending: true` accepts only a list whose numbers do not fall.
"""

import functools
import math
import operator
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import jsonschema

from lowalt.config.extensions import offered
from lowalt.files.errors import InputError, instead, shown
from lowalt.files.shipped import SHIPPED
from lowalt.files.yaml_files import load_yaml

BROUGHT = Path(__file__).with_name("brought.schema.yaml")
NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")
"""A number in YAML 1.2. PyYAML and Snakemake read YAML 1.1, in which 28e9 is a text."""


def _whole(checker: Any, value: object) -> bool:
    """Whether a value is an integer of 64 bits."""
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63


def _number(checker: Any, value: object) -> bool:
    """Whether a value is a finite number."""
    return _whole(checker, value) or (isinstance(value, float) and math.isfinite(value))


def _pattern(
    validator: Any, pattern: str, value: object, schema: dict
) -> Iterator[jsonschema.ValidationError]:
    """Refuse text with control characters or that does not match the pattern."""
    if isinstance(value, str) and any(ord(sign) < 32 or ord(sign) == 127 for sign in value):
        yield jsonschema.ValidationError("control characters")
    yield from jsonschema.Draft202012Validator.VALIDATORS["pattern"](
        validator, pattern, value, schema
    )


def _const(
    validator: Any, wanted: object, value: object, schema: dict
) -> Iterator[jsonschema.ValidationError]:
    """Refuse what differs from the one value; "inf" stands for an infinity, which JSON lacks."""
    if wanted != "inf" or value != math.inf:
        yield from jsonschema.Draft202012Validator.VALIDATORS["const"](
            validator, wanted, value, schema
        )


def _ascending(
    validator: Any, wanted: bool, value: object, schema: dict
) -> Iterator[jsonschema.ValidationError]:
    """Refuse a list of numbers in which one is smaller than the number before it."""
    if not isinstance(value, (list, tuple)) or not all(_number(None, item) for item in value):
        return
    if wanted and list(value) != sorted(value):
        yield jsonschema.ValidationError("not ascending")


def _array(checker: Any, value: object) -> bool:
    """Whether a value is a list, or a tuple in its place."""
    return isinstance(value, (list, tuple))


Validator = jsonschema.validators.extend(
    jsonschema.Draft202012Validator,
    {"pattern": _pattern, "const": _const, "ascending": _ascending},
    type_checker=jsonschema.Draft202012Validator.TYPE_CHECKER.redefine_many(
        {"integer": _whole, "number": _number, "array": _array}
    ),
)


COUNTS = ("minProperties", "maxProperties")
"""Rules of a schema on the number of a block's keys."""


def plain(value: Any) -> Any:
    """Return checked settings with infinities as the text "inf", which JSON has not as a number."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


def _innermost(errors: Iterable[Any]) -> Iterator[Any]:
    """The innermost errors, such as those within each of several choices."""
    for error in errors:
        if error.context:
            yield from _innermost(error.context)
        else:
            yield error


def with_numbers(settings: Any, schema: dict) -> Any:
    """Return settings that people write in YAML, their numbers read as meant.

    Nested values change in place. Where a schema expects a number and no text, a text such as 28e9
    is one; where it expects an integer, so is 4.0e+2.
    """
    held: Any = [settings]
    for error in _innermost([*Validator(schema).iter_errors(settings)]):
        if error.validator != "type":
            continue
        value = error.instance
        wanted = error.validator_value
        if isinstance(wanted, str):
            wanted = [wanted]
        kinds = set(wanted)
        if isinstance(value, str) and NUMBER.fullmatch(value):
            value = float(value)
        if isinstance(value, float) and "integer" in kinds - {"number"} and value.is_integer():
            value = int(value)
        fits = any(Validator.TYPE_CHECKER.is_type(value, kind) for kind in kinds)
        if value is not error.instance and fits:
            path: list[Any] = [0, *error.absolute_path]
            above = functools.reduce(operator.getitem, path[:-1], held)
            above[path[-1]] = value
    return held[0]


def _expected(error: Any) -> str:
    """Return the schema's expectation in words."""
    rule = error.validator
    wanted = error.validator_value
    if rule == "oneOf":
        # For a number out of range state the range, otherwise the expected types.
        for choice in error.context:
            if choice.validator not in ("type", "const"):
                return _expected(choice)
        return " or ".join(str(one.get("const", one.get("type"))) for one in wanted)
    if rule == "dependentRequired":
        key = next(key for key in wanted if key in error.instance)
        return " together with ".join([key, *wanted[key]])
    if rule == "not" and isinstance(wanted, dict):
        return f"none of {wanted.get('enum')}"
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
        "ascending": "the least number first",
        "pattern": f"text like {wanted}",
    }
    if rule in words:
        return words[rule]
    if len(error.message) > 200:
        return "another value"
    return error.message


def _fault(error: Any) -> str:
    """Return what is wrong with a value and what was expected."""
    if error.validator == "additionalProperties":
        known = sorted(error.schema.get("properties", {}))
        unknown = [name for name in error.instance if name not in known]
        return f"unknown key(s) {shown(unknown)}, expected {instead(unknown, known)}"
    if error.validator == "required":
        missing = [name for name in error.validator_value if name not in error.instance]
        return f"missing key(s) {missing}"
    text = f"value {shown(error.instance)}, expected {_expected(error)}"
    if isinstance(error.schema, dict) and error.schema.get("description"):
        text += f" ({error.schema['description']})"
    return text


def faults(settings: object, schema: dict, whole: str = "configuration") -> list[str]:
    """Return one line per fault of settings against a schema: key, value and the expected value.

    whole: name of the checked settings. If several items of a list have the same fault, the first
    is named.
    """

    def order(error: Any) -> tuple:
        """By key; a fault of a block's number of keys comes after the block's other faults."""
        return [*map(str, error.absolute_path)], error.validator in COUNTS

    lines: dict[tuple, str] = {}
    for error in sorted(Validator(schema).iter_errors(settings), key=order):
        block = tuple(name for name in error.absolute_path if isinstance(name, str))
        # If a block has another fault, do not report its number of keys.
        if error.validator not in COUNTS or not any(other[:-1] == block for other in lines):
            key = ".".join(map(str, error.absolute_path)) or whole
            lines.setdefault((*block, error.validator), f"{key}: {_fault(error)}")
    return list(lines.values())


def with_extensions(path: str | Path) -> dict:
    """Return the schema of the configuration in a file, with the extensions' effects and spectra.

    The modules of extensions check their own settings.
    """
    schema = load_yaml(path)
    for block in ("effects", "spectra"):
        known = schema.get("properties", {}).get(block, {}).get("properties", {})
        for name in offered(block):
            known.setdefault(name, {"type": "object"})
    return schema


@functools.cache
def _brought() -> dict:
    """The schema of settings in files, with the configuration's, with which it shares blocks."""
    return {
        **load_yaml(BROUGHT)["$defs"],
        "config": with_extensions(SHIPPED / "workflow/schemas/config.schema.yaml"),
    }


def of_brought(definition: str) -> dict:
    """Return the schema of a definition of `brought.schema.yaml`."""
    return {"$ref": f"#/$defs/{definition}", "$defs": _brought()}


def check_brought(definition: str, settings: object, where: str | Path) -> None:
    """Refuse wrong settings of a file before they are used.

    definition: one of `brought.schema.yaml`; where: the file.
    Raises: InputError naming the file, the first key that is wrong, its value and what was
    expected.
    """
    try:
        lines = faults(settings, of_brought(definition), definition)
    except RecursionError:
        raise InputError(
            f"{where}: values stand in each other too deeply, expected a few levels"
        ) from None
    if lines:
        raise InputError(f"{where}: {lines[0]}")
