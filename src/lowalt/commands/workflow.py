"""The commands `lowalt run` and `lowalt status`: Snakemake underneath, in the same folders and files."""

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

from lowalt.common.errors import InputError
from lowalt.common.shipped import SHIPPED, shipped
from lowalt.common.yaml_files import load_yaml
from lowalt.workflow import status

SNAKEFILE = SHIPPED / "Snakefile"


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add `run` and `status` to a parser's commands."""
    line = commands.add_parser(
        "run", help="run the workflow: the default, or with overlays",
        epilog="example: lowalt run config/tiny.yaml --target data --cores 2",
    )  # fmt: skip
    line.add_argument("overlay", type=shipped, nargs="*", help="overlays on the default configuration")
    line.add_argument(
        "--configfile", type=shipped, nargs="+", default=[], help="more overlays, as snakemake names them"
    )
    line.add_argument("--target", nargs="+", default=[], help="rules or files to make (default: everything)")
    line.add_argument("--cores", default="all", help="cores to use (default: all)")
    line.add_argument("-n", "--dry-run", action="store_true", help="only say what would be made, and why")
    line.add_argument("--profile", type=shipped, help="profile of a cluster, such as profiles/slurm")
    state = commands.add_parser(
        "status", help="the state of a run in another terminal", epilog="example: lowalt status"
    )
    state.add_argument("--json", action="store_true", help="print JSON for a program")


def command(given: argparse.Namespace) -> list[str]:
    """Return the command line of Snakemake.

    Raises: InputError naming an overlay that is missing or no YAML mapping, or where there is no Snakefile.
    """
    if not SNAKEFILE.is_file():
        raise InputError(f"no {SNAKEFILE}: this installation has no workflow, expected one from a wheel or a clone")
    overlays = [*given.overlay, *given.configfile]
    for path in overlays:
        if not path.is_file():
            raise InputError(f"configuration: no file at {path}")
        load_yaml(path)
    base = [] if Path("config/default.yaml").is_file() else [SHIPPED / "config/default.yaml"]
    line = [sys.executable, "-m", "snakemake", "--snakefile", str(SNAKEFILE), "--cores", given.cores]
    profile = given.profile or (None if Path("profiles").is_dir() else shipped("profiles/default"))
    line += ["--workflow-profile", str(profile)] if profile else []
    line += ["--configfile", *map(str, [*base, *overlays])] if base or overlays else []
    line += ["--dry-run"] if given.dry_run else []
    return [*line, "--", *given.target] if given.target else line


def run(given: argparse.Namespace) -> str:
    """Run Snakemake in this folder; end with its status where that is not 0.

    Raises: as `command`.
    """
    ended = subprocess.run(command(given)).returncode
    if ended:
        raise SystemExit(ended)
    return ""


def states(given: argparse.Namespace) -> str:
    """Return the state of the runs of this folder.

    Raises: InputError where no run has started here.
    """
    kept = status.read()
    if not kept:
        raise InputError(f"no run has started here: {status.FOLDER} is empty")
    if given.json:
        return json.dumps([entry | {"alive": status.alive(entry)} for entry in kept])
    living = [entry for entry in kept if status.alive(entry)]
    return "\n".join(status.describe(entry, time.time()) for entry in living or kept[-1:])
