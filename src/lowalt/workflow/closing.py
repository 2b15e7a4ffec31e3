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
    papers = averages(config["report"]["published"])
    result = []
    if ours:
        last_scheme, _ = list(ours)[-1]
        by_protocol = []
        for (scheme, protocol), percent in ours.items():
            if scheme != last_scheme:
                continue
            accuracy = f"{protocol} {percent:.1f} %"
            if (scheme, protocol) in papers:
                accuracy += f" (paper {papers[scheme, protocol]:.1f})"
            by_protocol.append(accuracy)
        result.append(f"accuracy of {last_scheme}: {', '.join(by_protocol)}")
    # The command beside this Python, as the user would type it here.
    command = Path(sys.executable).with_name("lowalt")
    typed = command.name
    if command.is_relative_to(Path.cwd()):
        typed = str(command.relative_to(Path.cwd()))
    more = "run config/scenes/urban.yaml: the same with multipath, clutter and hardware faults"
    if config["targets"]["select"]:
        more = "run: all subtypes, as in the paper"
    return [
        *result,
        f"page: {folder / 'report.html'}",
        f"next: {typed} {more}",
        f"      {typed} sample Crow 3 --snr 13 --out samples: one sample as files and as a picture",
    ]
