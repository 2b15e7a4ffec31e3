"""The command `lowalt mist`."""

import argparse

from lowalt.commands.command_line import Answer, add_command, positive
from lowalt_mist.effect import DEFAULTS, share


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `mist` to a parser's commands."""
    line = add_command(commands, name, run)
    line.add_argument("way", type=positive(1e6, "metres, such as 500"), help="length of the way (m)")


def run(options: argparse.Namespace) -> Answer:
    """Say which share of its amplitude a wave keeps."""
    kept = float(share(DEFAULTS["db_per_km"], options.way))
    return Answer({"amplitude_share": kept}, f"{kept:.4f} of the amplitude is left")
