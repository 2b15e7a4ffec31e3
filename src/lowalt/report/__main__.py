"""Command line of the report: the run's tables, pictures and measurements -> one self-contained HTML page."""

import json
import sys
from pathlib import Path

from lowalt.common.command import parser, pick, run
from lowalt.common.files import replacing
from lowalt.motion import read_table
from lowalt.report.figures.stills import write_stills
from lowalt.report.inputs import Inputs
from lowalt.report.page import contents, page, plots
from lowalt.report.plots import write_plots
from lowalt.report.run import ReportedRun
from lowalt.report.sections.stages import write_stages
from lowalt.targets.cloud import read


def main(arguments: list[str]) -> None:
    """Write the page, its figures as SVG and CSV, and the stages' times as a table.

    Settings: config, published (rows of the table of targets).
    """
    options = parser("lowalt.report", __doc__)
    options.add_argument("--manifest", required=True, help="files of the run by name (.json)")
    options.add_argument("--stages", required=True, help="table of the stages' times to write (.csv)")
    options.add_argument("--figures", required=True, type=Path, help="folder of the figures to write (.svg, .csv)")
    options.add_argument("--out", required=True, help="page to write (.html)")
    given = options.parse_args(arguments)
    reported = ReportedRun(Inputs.read(given.manifest), *pick(given.settings, "config", "published"))
    write_stages(given.stages, reported)
    values = contents(reported)
    text = page(reported, values)
    write_plots(given.figures, plots(values))
    clouds = [read(path) for path in reported.inputs.paths("clouds")]
    gallery, motion = reported.inputs.path("gallery").read_bytes(), read_table(reported.inputs.path("motion"))
    write_stills(given.figures, clouds, gallery, motion)
    with replacing(given.out) as temporary:
        temporary.write_text(text)
    print(json.dumps({"report": given.out, "samples": len(reported.shards)}), file=sys.stderr)


if __name__ == "__main__":
    run(main)
