"""The command `lowalt report --gallery`: a page that links all finished runs and compares any two of them."""

import argparse
from pathlib import Path

from lowalt.commands.compare import facts
from lowalt.common.errors import InputError
from lowalt.common.files import replacing


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add `report` to a parser's commands."""
    line = commands.add_parser(
        "report", help="a page that links all finished runs and compares any two of them",
        epilog="example: lowalt report --gallery",
    )  # fmt: skip
    line.add_argument("--gallery", action="store_true", required=True, help="write RESULTS/index.html")
    line.add_argument("--results", type=Path, default=Path("results"), help="folder of runs (default: results)")


def run(given: argparse.Namespace) -> str:
    """Write index.html into the folder of runs; return what was written.

    Raises: InputError where the folder holds no run, or a run's tables or configuration cannot be read.
    """
    from lowalt.report.gallery import gallery

    folders = sorted(path.parent for path in given.results.glob("*/config.yaml"))
    if not folders:
        raise InputError(f"{given.results}: no run, expected folders with a config.yaml such as results/default")
    pages = {path.name: f"{path.name}/report.html" for path in folders if (path / "report.html").is_file()}
    text = gallery({path.name: facts(path) for path in folders}, pages)
    with replacing(given.results / "index.html") as temporary:
        temporary.write_text(text)
    return f"{given.results / 'index.html'}: {len(folders)} run{'s' if len(folders) > 1 else ''}"
