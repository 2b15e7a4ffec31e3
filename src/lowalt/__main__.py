"""The command `lowalt`, for people: run the workflow, look at scenes, spectra, samples and runs, make own targets.

Exit status: 0 done, 1 something was found wrong or a run failed, 2 bad input. Stages have commands of their own
(python -m lowalt.STAGE).
"""

import argparse
import sys
from pathlib import Path

from lowalt.commands import compare, completion, data, explain, report, sample, spectra, target, workflow
from lowalt.common.command import refusal
from lowalt.common.errors import InputError

CONFIG, SCHEMA = Path("config/default.yaml"), Path("workflow/schemas/config.schema.yaml")


def main(arguments: list[str] | None = None) -> int:
    """Run one command of `lowalt`; returns the exit status."""
    line = argparse.ArgumentParser(
        prog="lowalt", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = line.add_subparsers(dest="command", required=True)
    explain.add_to(commands, CONFIG, SCHEMA)
    workflow.add_to(commands)
    sample.add_to(commands, CONFIG, SCHEMA)
    data.add_to(commands, CONFIG, SCHEMA)
    compare.add_to(commands)
    report.add_to(commands)
    target.add_to(commands)
    spectra.add_to(commands, CONFIG, SCHEMA)
    completion.add_to(commands)
    given = line.parse_args(arguments)
    actions = {
        "run": workflow.run, "status": workflow.states, "sample": sample.run, "verify": data.verify,
        "remake": data.remake, "predict": data.predict, "compare": compare.run, "target": target.run,
        "spectra": spectra.run, "report": report.run, "explain": explain.run,
        "completion": lambda given: completion.script(line),
    }  # fmt: skip
    try:
        text = actions[given.command](given)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"error: {refusal(error)}", file=sys.stderr)
        return 2
    if text:
        print(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
