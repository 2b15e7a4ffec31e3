"""The commands `lowalt run` and `lowalt status`, which call Snakemake in the same folders and
files.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from lowalt.commands.command_line import Answer, add_command
from lowalt.config.command import exit_status
from lowalt.config.layers import read_layer
from lowalt.files.errors import InputError
from lowalt.files.shipped import SHIPPED, shipped
from lowalt.workflow import status
from lowalt.workflow.status import PLANNED_JOBS

SNAKEFILE = SHIPPED / "Snakefile"


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `run` or `status` to a parser's commands."""
    if name == "status":
        add_command(commands, name, states)
        return
    line = add_command(commands, name, run)
    line.add_argument(
        "overlay", type=shipped, nargs="*", help="overlays on the default configuration"
    )
    line.add_argument(
        "--configfile", type=shipped, nargs="+", default=[], help="more overlays, as in snakemake"
    )
    line.add_argument(
        "--target", nargs="+", default=[], help="rules or files to make (default: everything)"
    )
    line.add_argument("--cores", help="cores to use (default: all; with --profile what that says)")
    line.add_argument(
        "-n", "--dry-run", action="store_true", help="only say what would be made, and why"
    )
    line.add_argument(
        "-p",
        "--printshellcmds",
        action="store_true",
        help="print files, reason and command of every job",
    )
    line.add_argument(
        "--profile", type=shipped, help="profile of a cluster, such as profiles/slurm"
    )


def command(options: argparse.Namespace) -> list[str]:
    """Return the command line of Snakemake.

    Raises: InputError naming an overlay that is missing, no YAML mapping, or of a run and names
    code, wrong cores, a profile that is not there, or where there is no Snakefile.
    """
    if not SNAKEFILE.is_file():
        raise InputError(
            f"no {SNAKEFILE}: this installation has no workflow, expected one from a wheel or a clone"
        )
    overlays = [*options.overlay, *options.configfile]
    for path in overlays:
        if not path.is_file():
            raise InputError(
                f"configuration: no file at {path} (a rule or file to make is named by --target)"
            )
        read_layer(path, trains=True)
    base = [] if Path("config/default.yaml").is_file() else [SHIPPED / "config/default.yaml"]
    if options.cores not in (None, "all") and not (
        options.cores.isdecimal() and int(options.cores)
    ):
        raise InputError(
            f"--cores {options.cores!r}, expected a whole number of at least 1, or all"
        )
    # Snakemake would silently ignore a missing profile.
    if options.profile and not any(options.profile.glob("config*.yaml")):
        raise InputError(
            f"--profile {options.profile}: no config.yaml there, expected a folder such as profiles/slurm"
        )
    cores = options.cores or (None if options.profile else "all")
    line = [
        sys.executable,
        "-m",
        "snakemake",
        "--snakefile",
        str(SNAKEFILE),
        *(["--cores", cores] if cores else []),
    ]
    profile = options.profile or (
        None if Path("profiles").is_dir() else shipped("profiles/default")
    )
    line += ["--workflow-profile", str(profile)] if profile else []
    line += ["--configfile", *map(str, [*base, *overlays])] if base or overlays else []
    line += [
        *(["--dry-run"] if options.dry_run else []),
        *(["--printshellcmds"] if options.printshellcmds else []),
    ]
    return [*line, "--", *options.target] if options.target else line


def ended(options: argparse.Namespace) -> dict:
    """Run Snakemake in this folder and return its exit status, and with `options.json` what
    happened.

    That is the command line, the seconds, and by name the stages whose jobs ran; of a dry run the
    jobs that would run, each with its rule, files and reason. Snakemake's own text then goes to the
    standard error stream.
    Raises: as `command`.
    """
    line = command(options)
    if not options.json:
        return {"status": exit_status(subprocess.run(line).returncode)}
    begun = time.time()
    with tempfile.TemporaryDirectory() as folder:
        jobs = Path(folder, "jobs")
        ran = subprocess.run(line, stdout=2, env=os.environ | {PLANNED_JOBS: str(jobs)})
        planned = (
            [json.loads(text) for text in jobs.read_text().splitlines()] if jobs.exists() else []
        )
    answer = {
        "status": exit_status(ran.returncode),
        "command": line,
        "seconds": time.time() - begun,
    }
    if options.dry_run:
        return answer | {"jobs": planned}
    kept = [entry for entry in status.read() if entry["written"] >= begun]
    return answer | {"stages": kept[-1]["board"]["stages"] if kept else {}}


def run(options: argparse.Namespace) -> Answer:
    """Run Snakemake in this folder; the exit status is its own. Raises: as `command`."""
    ran = ended(options)
    return Answer(ran, "", ran["status"])


def states(options: argparse.Namespace) -> Answer:
    """Tell the state of the runs of this folder.

    Raises: InputError where no run has started here.
    """
    kept = [entry | {"alive": status.alive(entry)} for entry in status.read()]
    if not kept:
        raise InputError(f"no run has started here: {status.FOLDER} is empty")
    shown = [entry for entry in kept if entry["alive"]] or kept[-1:]
    return Answer(kept, "\n".join(status.describe(entry, time.time()) for entry in shown))
