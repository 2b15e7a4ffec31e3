"""Commands asked for help say what they do, and without options name those that they need."""

import importlib

import pytest


def assert_needed_options_are_named(needed: str, capsys: pytest.CaptureFixture) -> None:
    """Check lines `MODULE [COMMAND]: OPTIONS`, modules below the package.

    The help has a sentence before the options' meaning. Without options each command names just these.
    """
    for line in needed.strip().splitlines():
        command, _, options = line.partition(": ")
        module, *words = command.split()
        main = importlib.import_module(f"lowalt.{module}").main
        with pytest.raises(SystemExit) as stopped:
            main(words)
        assert stopped.value.code == 2, command
        assert capsys.readouterr().err.endswith(f"the following arguments are required: {options}\n"), command
        with pytest.raises(SystemExit):
            main([*words, "--help"])
        usage, _, rest = capsys.readouterr().out.partition("\n\n")
        said = rest.partition("options:")[0].partition("positional arguments:")[0]
        assert usage.startswith("usage: ") and len(said.split()) > 3 and "." in said, command
