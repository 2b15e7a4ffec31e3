"""The commands `lowalt run` and `lowalt status`, for the workflow in the current folder."""

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
from lowalt.machine.run_pipe import hold_pipe
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


def _refuse(options: argparse.Namespace) -> None:
    """Refuse options that Snakemake would ignore or refuse in words of its own."""
    if not SNAKEFILE.is_file():
        raise InputError(
            f"no {SNAKEFILE}: this installation has no workflow, expected one from a wheel or a "
            "clone"
        )
    for path in [*options.overlay, *options.configfile]:
        if not path.is_file():
            raise InputError(
                f"configuration: no file at {path} (a rule or file to make is named by --target)"
            )
        read_layer(path, trains=True)
    if options.cores not in (None, "all") and not (
        options.cores.isdecimal() and int(options.cores)
    ):
        raise InputError(
            f"--cores {options.cores!r}, expected a whole number of at least 1, or all"
        )
    # Snakemake would silently ignore a missing profile.
    if options.profile and not any(options.profile.glob("config*.yaml")):
        raise InputError(
            f"--profile {options.profile}: no config.yaml there, expected a folder such as "
            "profiles/slurm"
        )
    _refuse_a_cache_that_cannot_be_made()


def _refuse_a_cache_that_cannot_be_made() -> None:
    """Make the folder of Snakemake's cache, whose failure Snakemake would show as a traceback."""
    try:
        from platformdirs import user_cache_path
    except ImportError:
        # Snakemake, which brings this package, is missing, and its start says so.
        return
    cache = user_cache_path("snakemake", "snakemake") / "snakemake/source-cache"
    try:
        cache.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{cache}: {error.strerror}, expected XDG_CACHE_HOME: a folder that this user may write"
        ) from error


def command(options: argparse.Namespace) -> list[str]:
    """Return the command line of Snakemake.

    Raises: InputError naming an overlay that is missing, no YAML mapping, or of a run and names
    code, wrong cores, a profile that is not there, or where there is no Snakefile.
    """
    _refuse(options)
    line = [sys.executable, "-m", "snakemake", "--snakefile", str(SNAKEFILE)]
    if options.cores:
        line += ["--cores", options.cores]
    elif not options.profile:
        line += ["--cores", "all"]
    if options.profile:
        line += ["--workflow-profile", str(options.profile)]
    elif not Path("profiles").is_dir():
        line += ["--workflow-profile", str(shipped("profiles/default"))]
    configfiles = [*options.overlay, *options.configfile]
    if not Path("config/default.yaml").is_file():
        configfiles.insert(0, SHIPPED / "config/default.yaml")
    if configfiles:
        line += ["--configfile", *map(str, configfiles)]
    if options.dry_run:
        line.append("--dry-run")
    if options.printshellcmds:
        line.append("--printshellcmds")
    if options.target:
        line += ["--", *options.target]
    return line


def ended(options: argparse.Namespace) -> dict:
    """Run Snakemake in this folder and return its exit status and, for JSON, what happened.

    With `options.json` the answer has the command line, the seconds, and by name the stages whose
    jobs ran; of a dry run the jobs that would run, each with its rule, files and reason.
    Snakemake's own text then goes to the standard error stream.
    Raises: as `command`.
    """
    line = command(options)
    pipe = hold_pipe()
    if not options.json:
        return {"status": exit_status(subprocess.run(line, pass_fds=[pipe]).returncode)}
    begun = time.time()
    with tempfile.TemporaryDirectory() as folder:
        jobs = Path(folder, "jobs")
        environment = os.environ | {PLANNED_JOBS: str(jobs)}
        ran = subprocess.run(line, stdout=2, env=environment, pass_fds=[pipe])
        planned = []
        if jobs.exists():
            planned = [json.loads(text) for text in jobs.read_text().splitlines()]
    answer = {
        "status": exit_status(ran.returncode),
        "command": line,
        "seconds": time.time() - begun,
    }
    if options.dry_run:
        return answer | {"jobs": planned}
    kept = [entry for entry in status.read() if entry["written"] >= begun]
    answer["stages"] = {}
    if kept:
        answer["stages"] = kept[-1]["board"]["stages"]
    return answer


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
