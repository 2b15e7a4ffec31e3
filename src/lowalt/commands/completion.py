"""The command `lowalt completion`: a shell script for tab completion of commands, options and
files.
"""

import argparse
from collections.abc import Iterator

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


def parsers(
    line: argparse.ArgumentParser, path: str = ""
) -> Iterator[tuple[str, list[str], list[str]]]:
    """Yield the words, such as " target make", the options and the names of commands of a parser
    and all below it.
    """
    below = {
        name: parser
        for action in line._actions
        if isinstance(action, argparse._SubParsersAction)
        for name, parser in action.choices.items()
    }
    yield (
        path,
        [word for action in line._actions for word in action.option_strings if word[:2] == "--"],
        [*below],
    )
    for name, parser in below.items():
        yield from parsers(parser, f"{path} {name}")


def script(line: argparse.ArgumentParser) -> str:
    """Return the script that completes the commands of a parser."""
    rows = [(path, " ".join(options), " ".join(names)) for path, options, names in parsers(line)]
    cases = "\n".join(
        f'    "{path}") options="{options}"; names="{names}";;' for path, options, names in rows
    )
    return SCRIPT.format(paths=" | ".join(f'"{path}"' for path, _, _ in rows if path), cases=cases)
