"""The command `lowalt`, for people: run the workflow, look at scenes, spectra, samples and runs,
make own targets.

Exit status: 0 done, 1 something was found wrong or a run failed, 2 bad input, 130 interrupted.
Stages have commands of their own (python -m lowalt.STAGE).
"""

import argparse
import signal
import sys
from importlib import import_module

from lowalt.commands.command_table import COMMANDS
from lowalt.config.command import USER_ERRORS, drop_output, error_sentence, warn_in_one_line
from lowalt.config.core_commands import CORE_COMMANDS, Command
from lowalt.config.extensions import extensions_in_words, function_offered
from lowalt.files.atomic import FULL
from lowalt.files.errors import InputError, in_plain_characters
from lowalt.machine.memory import refuse_little


def command_line(asked: str) -> argparse.ArgumentParser:
    """Return the parser of `lowalt`, with the options of the command `asked`, or of all for
    "completion".
    """
    examples = "\n".join(f"  {entry.example}" for entry in COMMANDS.values())
    line = argparse.ArgumentParser(
        prog="lowalt",
        description=__doc__,
        epilog=f"examples:\n{examples}\n\n{extensions_in_words()}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = line.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, entry in COMMANDS.items():
        if asked in (name, "completion"):
            _add(commands, name, entry)
        else:
            commands.add_parser(name, help=entry.meaning)
    return line


def _add(commands: argparse._SubParsersAction, name: str, entry: Command) -> None:
    """Add a command with its options; one whose extension is faulty gets a sentence in their place."""
    if name in CORE_COMMANDS:
        import_module(entry.module).add_to(commands, name)
        return
    try:
        add_to = function_offered("commands", name, entry.module, "add_to")
    except (InputError, ImportError) as error:
        print(f"error: {error_sentence(error)}", file=sys.stderr)
        commands.add_parser(name, help=entry.meaning).set_defaults(act=None)
    else:
        add_to(commands, name)


def main(arguments: list[str] | None = None) -> int:
    """Run one command of `lowalt`; returns the exit status."""
    words = sys.argv[1:] if arguments is None else arguments
    try:
        return _acted(words)
    except BrokenPipeError:
        # The reader, such as `head`, has closed its end.
        drop_output()
        return 128 + signal.SIGPIPE
    except USER_ERRORS as error:
        if isinstance(error, OSError) and error.errno in FULL:
            drop_output()
        print(f"error: {error_sentence(error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(
            "interrupted: the same command continues a run, and starts anything else again",
            file=sys.stderr,
        )
        return 128 + signal.SIGINT


def _acted(words: list[str]) -> int:
    """Run the command of these words; returns its exit status. Raises: as the command does."""
    asked = next((word for word in words if not word.startswith("-")), "")
    if asked in COMMANDS:
        refuse_little()
    try:
        options = command_line(asked).parse_args(words)
    except SystemExit:
        # Help goes to standard output, which may be full.
        sys.stdout.flush()
        raise
    if options.act is None:
        return 2
    warn_in_one_line()
    answer = options.act(options)
    text = answer.text
    if options.json:
        from lowalt.commands.command_line import as_json

        text = as_json(answer.facts)
    if text:
        print(in_plain_characters(text))
    sys.stdout.flush()
    return answer.status


if __name__ == "__main__":
    raise SystemExit(main())
