"""Command line of the report: the run's tables, pictures and measurements -> one self-contained HTML page."""

import json
import sys
from pathlib import Path

from lowalt.common.command import parser, pick, run
from lowalt.common.files import replacing
from lowalt.report.inputs import Inputs
from lowalt.report.page import contents, page, plots
from lowalt.report.plots import write_plots
from lowalt.report.run import ReportedRun
from lowalt.report.sections.stages import write_stages


def main(arguments: list[str]) -> None:
    """Write the page, its plots as SVG and CSV, and the stages' times as a table.

    Settings: config, published (rows of the table of targets).
    """
    options = parser("lowalt.report", __doc__)
    options.add_argument("--manifest", required=True, help="files of the run by name (.json)")
    options.add_argument("--stages", required=True, help="table of the stages' times to write (.csv)")
    options.add_argument("--figures", required=True, type=Path, help="folder of the plots to write (.svg, .csv)")
    options.add_argument("--out", required=True, help="page to write (.html)")
    given = options.parse_args(arguments)
    reported = ReportedRun(Inputs.read(given.manifest), *pick(given.settings, "config", "published"))
    write_stages(given.stages, reported)
    values = contents(reported)
    text = page(reported, values)
    write_plots(given.figures, plots(values))
    with replacing(given.out) as temporary:
        temporary.write_text(text)
    print(json.dumps({"report": given.out, "samples": len(reported.shards)}), file=sys.stderr)


if __name__ == "__main__":
    run(main)
