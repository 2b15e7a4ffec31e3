"""The types of a record's fields, joined over all records of a data set.

Arrow and the hub's library give each field one type. A field that is null, or a list that is empty,
in one record has its type from the others, so that no record decides alone. The joined type does
not depend on the order of the records; only the order of a mapping's fields does, which is that of
their first appearance.
"""

from collections.abc import Iterable
from typing import NamedTuple

from lowalt.files.errors import InputError
from lowalt.spectra.cube import TRUTH

SCALARS = {bool: "bool", int: "int64", float: "float64", str: "string"}
"""The hub's type names for values of JSON."""
NULL = "float64"
"""Type of a field that is null in all records: an unknown number."""


class ListOf(NamedTuple):
    """The type of a list; item: the type of its entries, None where no record has any."""

    item: "Type"


Type = None | str | ListOf | dict[str, "Type"]
"""None where nothing is known, the name of a scalar's type, or the types of a mapping's fields."""

EMPTY: dict[str, Type] = {
    "companions": "string",
    "others": {name: ListOf("float64") for name in TRUTH},
    "reflected": ListOf("string"),
}
"""Declared types of the entries of lists that may be empty in all records, by the field's name."""
UNDECLARED = "string"
"""Type of the entries of any other list that is empty in all records."""


def type_of(value: object, where: str) -> Type:
    """Return the type of a value of JSON; `where` names the value in messages.

    Raises: InputError where the entries of a list have types that do not join.
    """
    if value is None:
        return None
    if isinstance(value, dict):
        return {name: type_of(item, f"{where}.{name}") for name, item in value.items()}
    if value == "inf":
        # Records of version 0.2 write the SNR of a sample without noise as a text.
        return SCALARS[float]
    if not isinstance(value, list):
        return SCALARS[type(value)]
    kinds = set(map(type, value))
    if kinds <= set(SCALARS):
        # Lists of numbers are long, so each type is joined once.
        return ListOf(joined_all([SCALARS[kind] for kind in kinds], where))
    return ListOf(joined_all([type_of(item, where) for item in value], where))


def joined_all(types: Iterable[Type], where: str) -> Type:
    """Return the join of some types, None of none. Raises: InputError as `joined`."""
    result: Type = None
    for each in types:
        result = joined(result, each, where)
    return result


def joined(first: Type, second: Type, where: str) -> Type:
    """Return the narrowest type that holds values of both.

    An unknown type joins any; whole numbers and other numbers join as float64; lists by their
    entries; mappings field by field.
    Raises: InputError naming the field and both types for any other two, which no typed column
    holds.
    """
    if first is None or first == second:
        return second
    if second is None:
        return first
    if isinstance(first, dict) and isinstance(second, dict):
        result = dict(first)
        for name, kind in second.items():
            result[name] = joined(result.get(name), kind, f"{where}.{name}")
        return result
    if isinstance(first, ListOf) and isinstance(second, ListOf):
        return ListOf(joined(first.item, second.item, where))
    if sorted(map(str, (first, second))) == ["float64", "int64"]:
        return "float64"
    names = " and ".join(sorted({_word(first), _word(second)}))
    raise InputError(f"{where}: {names} in records of one data set, expected one type in all")


def _word(kind: Type) -> str:
    """A type in a message."""
    if isinstance(kind, dict):
        return "mapping"
    if isinstance(kind, ListOf):
        return "list"
    return str(kind)


def column(name: str, kind: Type) -> dict:
    """Return a field as the hub writes the columns of a data set."""
    return {"name": name, **_written(name, kind)}


def _written(name: str, kind: Type) -> dict:
    """The type of a field in the hub's words."""
    if isinstance(kind, dict):
        return {"struct": [column(*field) for field in kind.items()]}
    if kind is None:
        return {"dtype": NULL}
    if not isinstance(kind, ListOf):
        return {"dtype": kind}
    item = kind.item
    if item is None:
        item = EMPTY.get(name, UNDECLARED)
    # Inside a list, a scalar stands by its name and a mapping as its fields.
    inner = _written("", item)
    return {"list": inner.get("dtype") or inner.get("struct") or inner}
