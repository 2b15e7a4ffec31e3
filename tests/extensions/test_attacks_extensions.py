"""Damaged files of every kind that extensions read."""

import fuzzed_extensions
import pytest

import fuzzing

READERS = {reader.name: reader for reader in fuzzed_extensions.readers()}


@pytest.mark.parametrize("name", READERS)
def test_a_good_file_is_accepted_and_damaged_ones_are_accepted_or_refused_by_name(name, tmp_path):
    reader = READERS[name]
    found = fuzzing.attack(reader, 8 if reader.share == 1 else 1, 3, tmp_path)
    assert not found["faults"], found["first_fault"]
