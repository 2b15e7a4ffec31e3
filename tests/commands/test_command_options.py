"""Options of commands: the number that an option has by itself is the one that its help names."""

import argparse
import importlib
import re

import pytest

COMMANDS = ("measure.network_speed",)


class _AskedError(Exception):
    """Carries the parser of a command that is about to read its options."""


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_an_option_names_the_number_that_it_has_by_itself(command, monkeypatch):
    def asked(parser, arguments):
        raise _AskedError(parser)

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", asked)
    with pytest.raises(_AskedError) as caught:
        importlib.import_module(f"lowalt.{command}").main([])
    (parser,) = caught.value.args
    numbers = {action.dest: action for action in parser._actions if isinstance(action.default, (int, float))}
    assert numbers and not any(action.required for action in numbers.values())
    for name, action in numbers.items():
        told = re.search(r"\(default:? ([0-9.e+-]+)", action.help)
        assert told and float(told[1]) == action.type(action.default) == action.default, name
