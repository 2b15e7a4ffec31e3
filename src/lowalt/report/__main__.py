"""Command line of the report: a run's tables, pictures and measurements -> one HTML page."""

import json
import sys
from functools import partial
from pathlib import Path

from lowalt.config.command import parser, pick, run
from lowalt.files.atomic import write_file
from lowalt.machine.side_by_side import together
from lowalt.report.inputs import Inputs
from lowalt.report.page import SECTIONS, page, section
from lowalt.report.plots import write_plots
from lowalt.report.reported_run import ReportedRun
from lowalt.report.stage_times import write_stages


def main(arguments: list[str]) -> None:
    """Write the page, its figures as SVG and CSV, and the stages' times as a table.

    Settings: config, published (rows of the table of targets).
    """
    line = parser("lowalt.report", __doc__)
    line.add_argument("--manifest", required=True, help="files of the run by name (.json)")
    line.add_argument("--stages", required=True, help="table of the stages' times to write (.csv)")
    line.add_argument(
        "--figures", required=True, type=Path, help="folder of the figures to write (.svg, .csv)"
    )
    line.add_argument("--out", required=True, help="page to write (.html)")
    line.add_argument(
        "--jobs", type=int, default=1, help="sections made at a time, each in a process of its own"
    )
    options = line.parse_args(arguments)
    config, published = pick(options.settings, "config", "published")
    reported = ReportedRun(Inputs.read(options.manifest), config, published)
    write_stages(options.stages, reported)
    sections = together([partial(section, reported, name) for name in SECTIONS], options.jobs)
    plots = []
    for made in sections:
        plots += made.plots
    write_plots(options.figures, plots)
    text = page(reported, dict(zip(SECTIONS, sections, strict=True)))
    write_file(options.out, text)
    print(json.dumps({"report": options.out, "samples": len(reported.shards)}), file=sys.stderr)


if __name__ == "__main__":
    run(main)
