"""Types of a record's fields: joined over all records, in any order, with a refusal of what no
typed column holds.
"""

from itertools import permutations

import pytest

from lowalt.files.errors import InputError
from lowalt.shards.record_types import column, joined_all, type_of
from tables import rows


def written(*values):
    """The column of a field with these values, alike in every order of the records."""
    results = []
    for order in permutations(values):
        kind = joined_all([type_of(value, "record.x") for value in order], "record.x")
        results.append(column("x", kind))
    assert all(result == results[0] for result in results)
    return {key: value for key, value in results[0].items() if key != "name"}


@pytest.mark.parametrize(
    "values, expected",
    rows("record_types", "types"),
)
def test_a_field_has_the_narrowest_type_that_holds_all_records(values, expected):
    assert written(*values) == expected


@pytest.mark.parametrize(
    "values, words",
    rows("record_types", "unlike"),
)
def test_unlike_types_are_refused_in_one_sentence_that_names_the_field(values, words):
    with pytest.raises(InputError, match=f"^record.x: {words} in records of one data set"):
        written(*values)


def test_lists_that_are_empty_in_all_records_have_their_declared_type():
    assert column("companions", type_of([], "x"))["list"] == "string"
    assert column("reflected", type_of([], "x"))["list"] == {"list": "string"}
    assert {"name": "range_m", "list": "float64"} in column("others", type_of([], "x"))["list"]
