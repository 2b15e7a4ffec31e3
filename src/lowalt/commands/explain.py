"""The command `lowalt explain` lists the effects that a scene simulates and those left out, with reason and cost."""

import argparse
import os
from pathlib import Path

from lowalt.commands.for_programs import as_json, json_option
from lowalt.common.config import load


def _sample(text: str) -> tuple[str, int]:
    """Subtype and motion model of a text such as "Crow:3"."""
    name, _, model = text.rpartition(":")
    if not name or not model.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r}, expected SUBTYPE:MODEL such as 'Crow:3'")
    return name, int(model)


def add_to(commands: argparse._SubParsersAction, base: Path, schema: Path) -> None:
    """Add `explain` to a parser's commands; base: the configuration by default; schema: its schema."""
    line = commands.add_parser(
        "explain", help="list the effects that a scene simulates and those left out, with reason and cost",
        epilog="example: lowalt explain config/scenes/urban.yaml --sample Crow:3",
    )  # fmt: skip
    line.add_argument("scene", type=Path, nargs="+", help="the scene, an overlay on the base; more may follow it")
    line.add_argument("--base", type=Path, default=base, help=f"base configuration (default: {base})")
    line.add_argument("--schema", type=Path, default=schema, help=f"its schema (default: {schema})")
    line.add_argument("--sample", type=_sample, action="append", default=[], metavar="SUBTYPE:MODEL")
    line.add_argument("--station", help="the station that listens (default: the first)")
    line.add_argument("--no-cost", action="store_true", help="do not measure times")
    json_option(line)


def run(given: argparse.Namespace) -> str:
    """Return the explanation as text, or as JSON.

    Raises: InputError where the configuration, a sample or a station is wrong.
    """
    from lowalt.effects.explain import scene_facts
    from lowalt.effects.explain_text import data, text

    inputs = os.environ.get("LOWALT_INPUTS")
    config = load([given.base, *given.scene], given.schema)
    found = scene_facts(config, Path(inputs) if inputs else None, given.sample, given.station, not given.no_cost)
    return as_json(data(found)) if given.json else text(found)
