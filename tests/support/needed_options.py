"""Commands asked for nothing: each ends and names the options that it needs."""

import importlib

import pytest


def ask_for_nothing(needed: str, capsys: pytest.CaptureFixture) -> None:
    """Check lines `MODULE [COMMAND]: OPTIONS`, modules below the package: without options, each names just these."""
    for line in needed.strip().splitlines():
        command, _, options = line.partition(": ")
        module, *words = command.split()
        with pytest.raises(SystemExit) as stopped:
            importlib.import_module(f"lowalt.{module}").main(words)
        assert stopped.value.code == 2, command
        assert capsys.readouterr().err.endswith(f"the following arguments are required: {options}\n"), command
