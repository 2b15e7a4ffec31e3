"""The last lines of a finished run: its accuracies next to the paper's, the path of its report, and
next steps.
"""

import sys
from pathlib import Path

from lowalt.files.csv_tables import number, read_csv
from lowalt.files.shipped import located
from lowalt.files.yaml_files import load_yaml


def averages(path: str | Path) -> dict[tuple[str, str], float]:
    """Return accuracies over all SNRs (%) by scheme and protocol, in the order of a table of
    accuracies.

    Raises: InputError if the file is missing or is not such a table.
    """
    rows = read_csv(path, "protocol", "scheme", "snr_db", "accuracy_percent")
    means = [row for row in rows if row["snr_db"] == "avg"]
    return {
        (row["scheme"], row["protocol"]): number(row, "accuracy_percent", path) for row in means
    }


def lines(folder: Path) -> list[str]:
    """Return the last lines of the run in `folder`, of the last scheme in its table of accuracies.

    Raises: InputError where a table or the run's configuration is missing or damaged.
    """
    config = located(load_yaml(folder / "config.yaml"))
    ours = averages(folder / "accuracy.csv")
    paper = averages(config["report"]["published"])
    command = Path(sys.executable).with_name("lowalt")
    shown = command.relative_to(Path.cwd()) if command.is_relative_to(Path.cwd()) else command.name
    last = list(ours)[-1][0] if ours else ""
    said = [
        f"{protocol} {percent:.1f} %"
        + (f" (paper {paper[last, protocol]:.1f})" if (last, protocol) in paper else "")
        for (scheme, protocol), percent in ours.items()
        if scheme == last
    ]
    more = (
        "run: all subtypes, as in the paper"
        if config["targets"]["select"]
        else ("run config/scenes/urban.yaml: the same with multipath, clutter and hardware faults")
    )
    return [
        *([f"accuracy of {last}: {', '.join(said)}"] if said else []),
        f"page: {folder / 'report.html'}",
        f"next: {shown} {more}",
        f"      {shown} sample Crow 3 --snr 13 --out samples: one sample as files and as a picture",
    ]
