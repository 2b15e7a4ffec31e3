"""The last lines of a finished run: accuracies next to the paper's, its report, and next steps."""

import sys
from pathlib import Path

from lowalt.files.csv_tables import number, read_csv
from lowalt.files.shipped import located
from lowalt.files.yaml_files import load_yaml


def averages(path: str | Path) -> dict[tuple[str, str], float]:
    """Return accuracies over all SNRs (%) by scheme and protocol, in the order of their table.

    Raises: InputError if the file is missing or is not such a table.
    """
    means = {}
    for row in read_csv(path, "protocol", "scheme", "snr_db", "accuracy_percent"):
        if row["snr_db"] == "avg":
            means[row["scheme"], row["protocol"]] = number(row, "accuracy_percent", path)
    return means


def lines(folder: Path) -> list[str]:
    """Return the last lines of the run in `folder`, of the last scheme in its table of accuracies.

    Raises: InputError where a table or the run's configuration is missing or damaged.
    """
    config = located(load_yaml(folder / "config.yaml"))
    ours = averages(folder / "accuracy.csv")
    paper = averages(config["report"]["published"])
    result = []
    if ours:
        last, _ = list(ours)[-1]
        said = []
        for (scheme, protocol), percent in ours.items():
            if scheme != last:
                continue
            accuracy = f"{protocol} {percent:.1f} %"
            if (scheme, protocol) in paper:
                accuracy += f" (paper {paper[scheme, protocol]:.1f})"
            said.append(accuracy)
        result.append(f"accuracy of {last}: {', '.join(said)}")
    command = Path(sys.executable).with_name("lowalt")
    shown = command.relative_to(Path.cwd()) if command.is_relative_to(Path.cwd()) else command.name
    more = "run config/scenes/urban.yaml: the same with multipath, clutter and hardware faults"
    if config["targets"]["select"]:
        more = "run: all subtypes, as in the paper"
    return [
        *result,
        f"page: {folder / 'report.html'}",
        f"next: {shown} {more}",
        f"      {shown} sample Crow 3 --snr 13 --out samples: one sample as files and as a picture",
    ]
