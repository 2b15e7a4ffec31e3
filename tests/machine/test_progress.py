"""A step that cannot count its parts says that it goes on, and says nothing once it has ended."""

import io
import time

import pytest

from lowalt.machine.progress import announced


def test_a_long_step_says_that_it_goes_on_and_stops_with_an_error_as_well():
    said = io.StringIO()
    with announced("reading", said, every_s=0.02):
        while said.getvalue().count("\n") < 3:
            time.sleep(0.005)
    lines = said.getvalue().splitlines()
    assert set(lines) == {"reading, 0 s"}
    with pytest.raises(KeyError), announced("reading", said, every_s=0.02):
        raise KeyError
    count = len(said.getvalue())
    time.sleep(0.06)
    assert len(said.getvalue()) == count
    quiet = io.StringIO()
    with announced("reading", quiet):
        pass
    assert not quiet.getvalue()
