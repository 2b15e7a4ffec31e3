"""The command `lowalt completion`: a script by which a shell completes commands, options and files."""

import argparse

SCRIPT = """# Completion of lowalt for bash and zsh; load it by: source <(lowalt completion)
if [ -n "${{ZSH_VERSION-}}" ]; then autoload -Uz compinit bashcompinit && compinit -u && bashcompinit; fi
_lowalt() {{
  # In zsh, number arrays from 0 and split words as bash does.
  if [ -n "${{ZSH_VERSION-}}" ]; then emulate -L ksh; fi
  local word="${{COMP_WORDS[COMP_CWORD]}}" path="" next="" options="" names=""
  for next in "${{COMP_WORDS[@]:1:$((COMP_CWORD - 1))}}"; do
    case "$path $next" in
{paths}
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


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add `completion` to a parser's commands."""
    commands.add_parser(
        "completion", help="print the completion of commands, options and files for bash and zsh",
        epilog="example: source <(lowalt completion)",
    )  # fmt: skip


def tree(line: argparse.ArgumentParser) -> dict[str, tuple[list[str], list[str]]]:
    """Return (options, names of commands) of a parser and all its commands, by their words such as " target make"."""
    found = {}

    def look(parser: argparse.ArgumentParser, path: str) -> None:
        """Note one parser, then those of its commands."""
        options, names = [], []
        for action in parser._actions:
            options += [word for word in action.option_strings if word.startswith("--")]
            if isinstance(action, argparse._SubParsersAction):
                names += list(action.choices)
                for name, below in action.choices.items():
                    look(below, f"{path} {name}")
        found[path] = options, names

    look(line, "")
    return dict(sorted(found.items()))


def script(line: argparse.ArgumentParser) -> str:
    """Return the script that completes the commands of a parser."""
    found = tree(line)
    paths = "\n".join(f'      "{path}") path="{path}";;' for path in found if path)
    cases = "\n".join(
        f'    "{path}") options="{" ".join(options)}"; names="{" ".join(names)}";;'
        for path, (options, names) in found.items()
    )
    return SCRIPT.format(paths=paths, cases=cases)
