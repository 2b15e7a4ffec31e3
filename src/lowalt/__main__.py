"""The command `lowalt`, for people: run the workflow, look at scenes, spectra, samples and runs, make own targets.

Exit status: 0 done, 1 something was found wrong or a run failed, 2 bad input. Stages have commands of their own
(python -m lowalt.STAGE).
"""

import argparse
import sys

from lowalt.commands import compare, completion, data, explain, recording, report, sample, spectra, target, workflow
from lowalt.commands.command_line import Answer, as_json
from lowalt.config.command import refusal
from lowalt.files.errors import InputError


def main(arguments: list[str] | None = None) -> int:
    """Run one command of `lowalt`; returns the exit status."""
    line = argparse.ArgumentParser(
        prog="lowalt", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = line.add_subparsers(dest="command", required=True)
    for part in (explain, workflow, sample, data, compare, report, target, recording, spectra):
        part.add_to(commands)
    completion.add_to(commands, line)
    options = line.parse_args(arguments)
    try:
        answer: Answer = options.act(options)
    except (InputError, OSError) as error:
        print(f"error: {error if isinstance(error, InputError) else refusal(error)}", file=sys.stderr)
        return 2
    text = as_json(answer.facts) if options.json else answer.text
    if text:
        print(text)
    return answer.status


if __name__ == "__main__":
    raise SystemExit(main())
