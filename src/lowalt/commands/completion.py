"""The command `lowalt completion`: a shell script that completes commands, options and files."""

import argparse
from collections.abc import Iterator
from typing import NamedTuple

from lowalt.commands.command_line import Answer, add_command

SCRIPT = """# Completion of lowalt for bash and zsh; load it by: source <(lowalt completion)
if [ -n "${{ZSH_VERSION-}}" ]; then autoload -Uz compinit bashcompinit && compinit -u && bashcompinit; fi
_lowalt() {{
  # In zsh, number arrays from 0 and split words as bash does.
  if [ -n "${{ZSH_VERSION-}}" ]; then emulate -L ksh; fi
  local word="${{COMP_WORDS[COMP_CWORD]}}" path="" next="" options="" names=""
  for next in "${{COMP_WORDS[@]:1:$((COMP_CWORD - 1))}}"; do
    case "$path $next" in
      {paths}) path="$path $next";;
    esac
  done
  case "$path" in
{cases}
  esac
  if [ -n "$names" ]; then COMPREPLY=($(compgen -W "$names $options" -- "$word"))
  elif [ "${{word:0:1}}" = - ]; then COMPREPLY=($(compgen -W "$options" -- "$word"))
  else COMPREPLY=($(compgen -f -- "$word")); fi
}}
complete -o filenames -F _lowalt lowalt .venv/bin/lowalt"""


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `completion` to the commands of a parser."""
    add_command(commands, name, run)


def run(_options: argparse.Namespace) -> Answer:
    """Return the script that completes every command."""
    from lowalt.__main__ import command_line

    text = script(command_line("completion"))
    return Answer({"script": text}, text)


class Completed(NamedTuple):
    """What may follow a command: path, its words such as " target make"; names: of its commands."""

    path: str
    options: list[str]
    names: list[str]


def parsers(line: argparse.ArgumentParser, path: str = "") -> Iterator[Completed]:
    """Yield what may follow the command of a parser and each command below it."""
    options = []
    commands: dict[str, argparse.ArgumentParser] = {}
    for action in line._actions:
        options += [word for word in action.option_strings if word.startswith("--")]
        if isinstance(action, argparse._SubParsersAction):
            commands |= action.choices
    yield Completed(path, options, list(commands))
    for name, parser in commands.items():
        yield from parsers(parser, f"{path} {name}")


def script(line: argparse.ArgumentParser) -> str:
    """Return the script that completes the commands of a parser."""
    paths = []
    cases = []
    for row in parsers(line):
        options = " ".join(row.options)
        names = " ".join(row.names)
        cases.append(f'    "{row.path}") options="{options}"; names="{names}";;')
        if row.path:
            paths.append(f'"{row.path}"')
    return SCRIPT.format(paths=" | ".join(paths), cases="\n".join(cases))
