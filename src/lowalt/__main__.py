"""The command `lowalt`, for people: run the workflow, look at scenes, spectra, samples and runs, make own targets.

Exit status: 0 done, 1 something was found wrong or a run failed, 2 bad input. Stages have commands of their own
(python -m lowalt.STAGE).
"""

import argparse
import os
import sys
from pathlib import Path

from lowalt.commands import compare, completion, data, report, sample, spectra, target, workflow
from lowalt.common.errors import InputError

CONFIG, SCHEMA = Path("config/default.yaml"), Path("workflow/schemas/config.schema.yaml")


def _sample(text: str) -> tuple[str, int]:
    """Subtype and motion model of a text such as "Crow:3"."""
    name, _, model = text.rpartition(":")
    if not name or not model.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r}, expected SUBTYPE:MODEL such as 'Crow:3'")
    return name, int(model)


def _explained(given: argparse.Namespace) -> str:
    """The text that `lowalt explain` prints for the arguments given."""
    from lowalt.effects.explain import explain_scene

    inputs = os.environ.get("LOWALT_INPUTS")
    return explain_scene(
        [given.base, *given.scene], given.schema, Path(inputs) if inputs else None, given.sample, given.station,
        not given.no_cost,
    )  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    """Run one command of `lowalt`; returns the exit status."""
    line = argparse.ArgumentParser(
        prog="lowalt", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = line.add_subparsers(dest="command", required=True)
    explain = commands.add_parser(
        "explain", help="what a scene simulates, what it leaves out and why, and what it costs",
        epilog="example: lowalt explain config/scenes/urban.yaml --sample Crow:3",
    )  # fmt: skip
    explain.add_argument("scene", type=Path, nargs="+", help="the scene, an overlay on the base; more may follow it")
    explain.add_argument("--base", type=Path, default=CONFIG, help=f"base configuration (default: {CONFIG})")
    explain.add_argument("--schema", type=Path, default=SCHEMA, help=f"its schema (default: {SCHEMA})")
    explain.add_argument("--sample", type=_sample, action="append", default=[], metavar="SUBTYPE:MODEL")
    explain.add_argument("--station", help="the station that listens (default: the first)")
    explain.add_argument("--no-cost", action="store_true", help="do not measure times")
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
        "spectra": spectra.run, "report": report.run, "explain": _explained,
        "completion": lambda given: completion.script(line),
    }  # fmt: skip
    try:
        text = actions[given.command](given)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    if text:
        print(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
