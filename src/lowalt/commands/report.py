"""The command `lowalt report`: the page of one run, or a page that links all runs and compares any two of them."""

import argparse
import tempfile
from pathlib import Path

import yaml

from lowalt.commands import workflow
from lowalt.commands.compare import facts
from lowalt.commands.for_programs import acts, as_json
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.files.shipped import as_named, shipped
from lowalt.files.yaml_files import load_yaml

BASE = "config/default.yaml"


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add `report` to a parser's commands."""
    line = commands.add_parser(
        "report", help="make the page of one run again, or a page that links all runs and compares any two",
        epilog="example: lowalt report results/default, or lowalt report --gallery",
    )  # fmt: skip
    line.add_argument("run", type=Path, nargs="?", help="folder of a run that was started here")
    line.add_argument("--cores", default="all", help="cores to use (default: all)")
    line.add_argument("-n", "--dry-run", action="store_true", help="only name the files that would be made, and why")
    line.add_argument("--gallery", action="store_true", help="write RESULTS/index.html")
    line.add_argument("--results", type=Path, default=Path("results"), help="folder of runs (default: results)")
    acts(line, run)


def run(given: argparse.Namespace) -> str:
    """Make the page or the gallery; return the names of the files written.

    Raises: InputError where neither or both are asked for, and as `page` and `gallery`.
    """
    if given.gallery == (given.run is not None):
        raise InputError("report: expected the folder of a run, such as results/default, or --gallery")
    return gallery(given) if given.gallery else page(given)


def page(given: argparse.Namespace) -> str:
    """Let the workflow make the page of a run, with all that it needs and that is not there or no longer current.

    Ends with the workflow's status where that is not 0. Raises: InputError where the folder holds no run.
    """
    from lowalt.report.provenance import changes

    if not (given.run / "config.yaml").is_file():
        raise InputError(f"{given.run}: has no config.yaml, expected the folder of a run")
    config = load_yaml(given.run / "config.yaml")
    name = config.get("run")
    written = f"results/{name}/report.html"
    if not isinstance(name, str) or given.run.resolve() != Path(written).parent.resolve():
        raise InputError(f"{given.run}: its config.yaml is of the run {name!r}, expected to stand in results/{name}")
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as overlay:
        yaml.safe_dump({"run": name, **changes(load_yaml(shipped(BASE)), as_named(config))}, overlay)
        overlay.flush()
        answer = workflow.ended(argparse.Namespace(
            overlay=[Path(overlay.name)], configfile=[], target=[written], cores=given.cores,
            dry_run=given.dry_run, profile=None, json=given.json,
        ))  # fmt: skip
    files = [] if given.dry_run or answer["status"] else [written]
    return workflow.said(given, {"files": files, **answer}, "".join(files))


def gallery(given: argparse.Namespace) -> str:
    """Write index.html into the folder of runs; return what was written.

    Raises: InputError where the folder holds no run, or a run's tables or configuration cannot be read.
    """
    from lowalt.report.all_runs import all_runs

    results = given.results
    folders = sorted(path.parent for path in results.glob("*/config.yaml"))
    if not folders:
        raise InputError(f"{results}: no run, expected folders with a config.yaml such as results/default")
    pages = {path.name: f"{path.name}/report.html" for path in folders if (path / "report.html").is_file()}
    text = all_runs({path.name: facts(path) for path in folders}, pages)
    with replacing(results / "index.html") as temporary:
        temporary.write_text(text)
    if given.json:
        return as_json({"files": [results / "index.html"], "runs": [path.name for path in folders]})
    return f"{results / 'index.html'}: {len(folders)} run{'s' if len(folders) > 1 else ''}"
