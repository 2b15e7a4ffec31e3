"""The command `lowalt report`: the page of one run, or a page that links and compares all runs."""

import argparse
import tempfile
from pathlib import Path

import yaml

from lowalt.commands import workflow
from lowalt.commands.command_line import Answer, add_command
from lowalt.commands.compare import facts
from lowalt.config.brought import refuse_brought, refuse_training
from lowalt.config.layers import SCHEMA, check, of_run
from lowalt.config.named_code import allowed
from lowalt.files.atomic import write_file
from lowalt.files.errors import InputError
from lowalt.files.shipped import as_named, shipped
from lowalt.files.yaml_files import load_yaml

BASE = "config/default.yaml"


def add_to(commands: argparse._SubParsersAction, name: str) -> None:
    """Add `report` to a parser's commands."""
    line = add_command(commands, name, run)
    line.add_argument("run", type=Path, nargs="?", help="folder of a run that was started here")
    line.add_argument("--cores", default="all", help="cores to use (default: all)")
    line.add_argument(
        "-n",
        "--dry-run",
        action="store_true",
        help="only name the files that would be made, and why",
    )
    line.add_argument("--gallery", action="store_true", help="write RESULTS/index.html")
    line.add_argument(
        "--results", type=Path, default=Path("results"), help="folder of runs (default: results)"
    )


def run(options: argparse.Namespace) -> Answer:
    """Make the page or the gallery; answer with the files written.

    Raises: InputError where neither or both are asked for, and as `page` and `gallery`.
    """
    if options.gallery == (options.run is not None):
        raise InputError(
            "report: expected the folder of a run, such as results/default, or --gallery"
        )
    if options.gallery:
        return gallery(options.results)
    return page(options)


def page(options: argparse.Namespace) -> Answer:
    """Let the workflow make the page of a run, and all its inputs that are missing or outdated.

    Raises: InputError where the folder holds no run.
    """
    from lowalt.report.provenance import changes

    config = of_run(options.run)
    name = config.get("run")
    written = f"results/{name}/report.html"
    if not isinstance(name, str) or options.run.resolve() != Path(written).parent.resolve():
        raise InputError(
            f"{options.run}: its config.yaml is of the run {name!r}, expected to stand in "
            f"results/{name}"
        )
    _refuse_code(config, options.run)
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as overlay:
        yaml.safe_dump(
            {"run": name, **changes(load_yaml(shipped(BASE)), as_named(config))}, overlay
        )
        overlay.flush()
        line = {
            "overlay": [Path(overlay.name)],
            "configfile": [],
            "target": [written],
            "profile": None,
            "printshellcmds": False,
        }
        ran = workflow.ended(argparse.Namespace(**vars(options) | line))
    files = []
    if not options.dry_run and ran["status"] == 0:
        files.append(written)
    return Answer({"files": files, **ran}, "".join(files), ran["status"])


def _refuse_code(config: dict, folder: Path) -> None:
    """Refuse a run that names code, weights or files elsewhere, which the workflow would use.

    Both its configuration and its table of schemes are looked at.
    """
    check(config, shipped(SCHEMA))
    how = (
        f"an overlay of your own that names it: `lowalt run OVERLAY --target {folder}/report.html`"
    )
    allowed(config["recognition"]["network"]["backbone"], "", folder, how)
    refuse_brought(config, folder / "config.yaml")
    refuse_training(config, folder, how)


def gallery(results: Path) -> Answer:
    """Write index.html into the folder of runs.

    Raises: InputError where the folder holds no run, or a run's tables or configuration cannot be
    read.
    """
    from lowalt.report.all_runs import all_runs

    folders = sorted(path.parent for path in results.glob("*/config.yaml"))
    if not folders:
        raise InputError(
            f"{results}: no run, expected folders with a config.yaml such as results/default"
        )
    pages = {
        path.name: f"{path.name}/report.html"
        for path in folders
        if (path / "report.html").is_file()
    }
    write_file(
        results / "index.html", all_runs({path.name: facts(path) for path in folders}, pages)
    )
    index = results / "index.html"
    names = [path.name for path in folders]
    plural = "s" if len(folders) > 1 else ""
    text = f"{index}: {len(folders)} run{plural}"
    return Answer({"files": [index], "runs": names}, text)
