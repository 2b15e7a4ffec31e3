"""The figure of recognition accuracy over its time, its training and the bytes it reads.

python -m lowalt.report.figures.accuracy_cost --table accuracy_cost.csv --figure accuracy_cost.png
"""

import argparse

from matplotlib import pyplot as plt

from lowalt.config.command import run
from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.report.figures.style import SNR_LABELS, png

NEEDED = (
    "scheme", "kind", "snr_db", "seen_percent", "unseen_percent", "inference_ms_64", "core_s_training", "network_bytes",
    "front",
)  # fmt: skip
FIDELITY = ("difference_points", "low", "high")
TOO_CLOSE = 1.6
"""Ratio of two times under which their labels would overlap."""


def _timed(panel, rows: list[dict], column: str, low: float) -> None:
    """Draw a line at the cost of each network that was only timed. Neighbouring lines share one label, which begins at
    height `low`."""
    times = [(row[column] or row.get("inference_ms_1"), row["scheme"]) for row in rows]
    found = sorted((float(time), name) for time, name in times if time)
    labels: list[tuple[float, list[str]]] = []
    for x, name in found:
        panel.axvline(x, color="0.8", lw=1, zorder=0)
        if labels and x < TOO_CLOSE * labels[-1][0]:
            labels[-1][1].append(name)
        else:
            labels.append((x, [name]))
    for x, names in labels:
        text = "\n".join(names) + " (timed only)"
        panel.text(x, low, text, rotation=90, fontsize=7, ha="right", va="bottom", linespacing=1.1)


def _points(panel, rows: list[dict], across: str, label: str) -> None:
    """Seen (hollow) and unseen (filled) accuracy of each scheme over a cost; the front of the unseen is joined."""
    for number, row in enumerate(rows):
        colour, x = plt.cm.tab20(number % 20), float(row[across])
        panel.plot(x, float(row["unseen_percent"]), "o", color=colour, label=row["scheme"])
        if row["seen_percent"]:
            panel.plot(x, float(row["seen_percent"]), "o", color=colour, fillstyle="none")
    front = sorted((float(row[across]), float(row["unseen_percent"])) for row in rows if row["front"] == "yes")
    if across == "inference_ms_64" and front:
        panel.step(*zip(*front, strict=True), where="post", color="0.5", lw=1, zorder=0)
    panel.set(xscale="log", xlabel=label, ylabel="accuracy (%)")
    panel.grid(alpha=0.3, which="both")


def _by_snr(panel, rows: list[dict], trained: list[dict]) -> None:
    """Unseen accuracy over SNR of the rows on the front; rows: of every SNR, trained: their averages."""
    for number, row in enumerate(trained):
        if row["front"] != "yes":
            continue
        found = [other for other in rows if other["scheme"] == row["scheme"] and other["kind"] == "trained"]
        found = [other for other in found if other["snr_db"] != "avg"]
        labels = [SNR_LABELS.get(other["snr_db"], other["snr_db"]) for other in found]
        panel.plot(labels, [float(other["unseen_percent"]) for other in found], "o-", color=plt.cm.tab20(number % 20))
    panel.set(xlabel="SNR (dB)", ylabel="unseen accuracy (%)")
    panel.set_title("by SNR: schemes that no faster one beats", fontsize=9)
    panel.grid(alpha=0.3)


def _fidelity(panel, rows: list[dict]) -> None:
    """Accuracy after training on echoes of a tolerance less that after exact ones, with its interval."""
    values = [float(row["difference_points"]) for row in rows]
    bars = [[value - float(row["low"]) for value, row in zip(values, rows, strict=True)],
            [float(row["high"]) - value for value, row in zip(values, rows, strict=True)]]  # fmt: skip
    panel.errorbar(range(len(values)), values, yerr=bars, fmt="o", capsize=4)
    panel.axhline(0, color="0.6", lw=1)
    names = [row["scheme"].rpartition(" ")[2].removeprefix("fidelity-") for row in rows]
    panel.set_xticks(range(len(names)), names)
    panel.set(xlabel="tolerance of the echoes trained on", ylabel="unseen accuracy less exact (points)")
    spreads = [float(row["spread_points"]) for row in rows if row.get("spread_points")]
    words = f"; another training seed: ±{max(spreads):.1f}" if spreads else ""
    panel.set_title(f"tested on exact echoes; bars: 95 % intervals{words}", fontsize=9)
    panel.grid(alpha=0.3)


def draw(rows: list[dict[str, str]]) -> bytes:
    """Draw a table of accuracy and its cost; returns PNG bytes.

    Above: accuracy over inference time, training time and bytes read, averaged over SNRs, the front joined and times of
    networks that were only timed as lines; below: unseen accuracy by SNR of the rows on the front, and what training on
    echoes at a tolerance changes.
    Raises: InputError where no row was trained.
    """
    average = [row for row in rows if row["snr_db"] == "avg"]
    trained = [row for row in average if row["kind"] == "trained"]
    if not trained:
        raise InputError("accuracy_cost: no trained row, expected at least one")
    timed = [row for row in average if row["kind"] == "timed"]
    fidelity = [row for row in average if row["kind"] == "fidelity"]
    figure, panels = plt.subplots(2, 3, figsize=(16, 9.6))
    (inference, training, read), (snr, echoes, rest) = panels
    _points(inference, trained, "inference_ms_64", "inference, ms a sample on one core (batch of 64)")
    _points(training, trained, "core_s_training", "training, core-seconds")
    _points(read, trained, "network_bytes", "bytes a sample that the network reads")
    read.set_xscale("linear")
    low = min(float(row["unseen_percent"]) for row in trained)
    _timed(inference, timed, "inference_ms_64", low)
    _timed(training, timed, "core_s_training", low)
    inference.set_title(
        "filled: unseen subtypes, hollow: seen;\ngrey: unseen accuracy that nothing faster beats", fontsize=9
    )
    training.set_title("networks only timed: training extrapolated", fontsize=9)
    _by_snr(snr, rows, trained)
    if fidelity:
        _fidelity(echoes, fidelity)
    else:
        echoes.set_axis_off()
    rest.set_axis_off()
    names, handles = {}, inference.get_legend_handles_labels()
    names.update(zip(handles[1], handles[0], strict=True))
    rest.legend(names.values(), names.keys(), loc="center", ncols=2, fontsize=8)
    hardware = next((row["hardware"] for row in trained if row.get("hardware")), "")
    figure.suptitle(f"Recognition accuracy over time ({hardware})", fontsize=10)
    figure.tight_layout()
    return png(figure)


def main(arguments: list[str]) -> None:
    """Write the figure."""
    options = argparse.ArgumentParser(prog="python -m lowalt.report.figures.accuracy_cost", description=__doc__)
    options.add_argument("--table", required=True, help="accuracy_cost.csv")
    options.add_argument("--figure", required=True, help="picture to write (.png)")
    given = options.parse_args(arguments)
    picture = draw(read_csv(given.table, *NEEDED, *FIDELITY))
    with replacing(given.figure) as temporary:
        temporary.write_bytes(picture)


if __name__ == "__main__":
    run(main)
