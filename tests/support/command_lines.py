"""Checks of the help, the parsing and the shell completion of command lines."""

import argparse
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from lowalt.__main__ import main

ROOT = Path(__file__).parents[2]


def parsed_only(monkeypatch, words):
    """A command line is understood; nothing is run."""
    whole = argparse.ArgumentParser.parse_args

    def stop(self, *given):
        """Parse, and go no further."""
        whole(self, *given)
        raise KeyError("understood")

    with monkeypatch.context() as changed, pytest.raises(KeyError, match="understood"):
        changed.setattr(argparse.ArgumentParser, "parse_args", stop)
        main(words)


def assert_help_with_example(words, capsys, monkeypatch):
    """A command, or an action of one, has a help with an example that parses."""
    with pytest.raises(SystemExit) as ended:
        main([*words, "--help"])
    text = " ".join(capsys.readouterr().out.split())
    assert ended.value.code == 0 and "example: " in text
    example = text.partition("example: ")[2].partition(", or ")[0]
    assert f"lowalt {' '.join(words)}" in example
    if words != ["completion"]:
        parsed_only(monkeypatch, shlex.split(example)[1:])


def completions(words, current, capsys):
    """Yield what each shell completes the word `current` to, after the words of a command line."""
    assert main(["completion"]) == 0
    words = " ".join(map(shlex.quote, [*words, current]))
    text = (
        f"{capsys.readouterr().out}\nCOMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1));"
        " _lowalt"
    )
    # Zsh lists files only while a person types.
    names = ("bash",) if "/" in current else ("bash", "zsh")
    shells = [shell for shell in map(shutil.which, names) if shell] or pytest.skip("no bash")
    for shell in shells:
        # A login's own settings of zsh stay out.
        own = ["-f"] if shell.endswith("zsh") else []
        asked = text + '; printf "%s\\n" "${COMPREPLY[@]}"'
        ran = subprocess.run([shell, *own, "-c", asked], capture_output=True, text=True, cwd=ROOT)
        assert ran.stderr == ""
        # Zsh itself leaves out what does not begin as the word does.
        yield [word for word in ran.stdout.split() if word.startswith(current)]
