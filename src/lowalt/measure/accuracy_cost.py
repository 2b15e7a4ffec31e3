"""Recognition accuracy against computing time: trained schemes, and networks that were only timed.

    python -m lowalt.measure.accuracy_cost --settings JSON --predictions a.csv ...
        --speeds a.json ... --data-jobs a.jsonl ... --index index.json --presets presets.csv
        --out accuracy_cost.csv

Settings: seed. accuracy_cost.csv, one row per scheme, accuracies averaged over the SNRs and the
training seeds:
    kind                 trained: accuracy and times measured; timed: times of a network that was
                         not trained, without accuracy, its core_s_training extrapolated from the
                         time of one step
    preset, command      name of a preset and the command that runs it
    backbone, pixels, stations, spectra, steps, train_samples, parameters
                         of the scheme
    seen_percent         held-out motion models of the trained subtypes
    unseen_percent       subtypes never trained on; macro_f1_low, macro_f1_high: 95 % interval of
                         its macro F1
    difference_points    unseen less that of the first scheme; low, high: its 95 % interval, which
                         resamples training seeds, subtypes and motion models
    inference_ms_1, inference_ms_64
                         of one sample on one core in batches of 1 and 64, images in memory
    train_ms             of one sample of a training step on one core, images in memory
    core_s_data          processor time of making the samples trained on: all spectra at the
                         stations that are seen
    core_s_training      processor time of the whole training, validation included
    network_bytes        bytes of images per sample that the network takes in
    seeds, spread_points training seeds, and the standard deviation of unseen accuracy between them
    front                Pareto front: no other row is more accurate on unseen subtypes in equal or
                         less time
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.config.network import station_names
from lowalt.files.atomic import text_of
from lowalt.files.csv_tables import read_csv, short, write_csv
from lowalt.files.errors import InputError
from lowalt.files.json_objects import read_object
from lowalt.machine.job_times import job_times
from lowalt.numerics.streams import stream
from lowalt.recognition.evaluated import Evaluated, difference
from lowalt.recognition.schemes import SPECTRA, TABLE, joined, named, names
from lowalt.recognition.statistics import pareto
from lowalt.recognition.tables import ACCURACY, accuracy_rows

COLUMNS = (
    "scheme",
    "kind",
    "preset",
    "command",
    "backbone",
    "pixels",
    "stations",
    "spectra",
    "steps",
    "train_samples",
    "parameters",
    "seen_percent",
    "unseen_percent",
    "macro_f1_low",
    "macro_f1_high",
    "difference_points",
    "low",
    "high",
    "inference_ms_1",
    "inference_ms_64",
    "train_ms",
    "core_s_data",
    "core_s_training",
    "network_bytes",
    "front",
    "hardware",
    "seeds",
    "spread_points",
)
PRESETS = ("preset", "scheme", "command", "predictions")
"""Columns of the table of presets; predictions: end of the folder of a study's, empty for a scheme
of this run.
"""
SPEED = (
    "backbone",
    "parameters",
    "inference_ms_1",
    "inference_ms_64",
    "train_ms",
    "steps",
    "hardware",
)


def read_speeds(
    paths: list[str | Path], table: str | Path, stations: Sequence[str]
) -> dict[str, dict]:
    """Return the columns that describe each scheme, and its share of the stations, by its name.

    paths: files of `network_speed`; table: table of schemes; stations: names of the network's
    stations, in its order.
    Raises: InputError for a file that is no such record, or a scheme that the table lacks.
    """
    rows = {}
    for path in paths:
        try:
            entry = json.loads(text_of(path, "speed"))
            row = {key: entry[key] for key in SPEED}
            name = entry["scheme"]
            pixels = entry["size"]
            extrapolated = entry["train_ms"] * entry["batch"] / 1e3
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"{path}: not a record of speed ({error!r})") from error
        scheme = named(table, name, stations)
        rows[name] = row | {
            "scheme": name,
            "kind": "timed",
            "pixels": pixels,
            "network_bytes": len(scheme.columns) * pixels**2,
            "spectra": "+".join(SPECTRA[number] for number in scheme.spectra),
            "stations": joined([stations[number] for number in scheme.stations]),
            "core_s_training": extrapolated * entry["steps"],
            "share": len(scheme.stations) / len(stations),
        }
    return rows


def sample_seconds(paths: list[str | Path], samples: int) -> float:
    """Return the processor seconds that the jobs of a data set took for each of its samples.

    paths: Snakemake's benchmark files (JSON lines, extended). Raises: InputError for a file that is
    none.
    """
    return sum(job_times(path).processor_s for path in paths) / samples


def _average(runs: list[Evaluated], part: str, seed: int) -> dict:
    """The row of accuracy.csv with the mean over the SNRs, which is the last, by column."""
    *_, last = accuracy_rows(runs, part, seed)
    return dict(zip(ACCURACY, last, strict=True))


def trained_row(runs: list[Evaluated], base: list[Evaluated], data_s: float, seed: int) -> dict:
    """Return the measured columns of a trained scheme, compared with `base` on the same samples.

    runs, base: trainings of the scheme and of the first scheme, one per seed; data_s: processor
    seconds per sample.
    Raises: as `evaluated.difference`.
    """
    about = runs[0].about
    unseen = _average(runs, "test", seed)
    seen_percent = ""
    if len(runs[0].part("seen_test")):
        seen_percent = _average(runs, "seen_test", seed)["accuracy_percent"]
    generator = stream(seed, "price", runs[0].scheme, "avg")
    points, low, high = (100 * value for value in difference(runs, base, generator))
    return {
        "kind": "trained",
        "steps": about["steps"],
        "train_samples": about["train_samples"],
        "seen_percent": seen_percent,
        "unseen_percent": unseen["accuracy_percent"],
        "macro_f1_low": unseen["macro_f1_low"],
        "macro_f1_high": unseen["macro_f1_high"],
        "hardware": unseen["hardware"],
        "seeds": unseen["seeds"],
        "spread_points": unseen["spread_points"],
        "difference_points": points,
        "low": low,
        "high": high,
        "core_s_data": data_s * about["train_samples"],
        "core_s_training": float(np.mean([run.about["train_processor_s"] for run in runs])),
    }


def table_rows(
    runs: dict[str, list[Evaluated]],
    speeds: dict[str, dict],
    presets: list[dict],
    data_s: float,
    seed: int,
) -> list[dict]:
    """Return the rows of accuracy_cost.csv: trained schemes in their order, then those only timed.

    runs: trainings of each scheme by its name, one per seed, the first scheme's first; speeds: as
    `read_speeds` gives them; presets: rows with the columns PRESETS. Raises: InputError for unequal
    numbers of trainings, and for a preset whose scheme was not trained.
    """
    counts = {name: len(of) for name, of in runs.items()}
    if len(set(counts.values())) != 1:
        raise InputError(f"trainings per scheme: {counts}, expected as many seeds of each")
    runs = {name: sorted(of, key=lambda training: training.seed) for name, of in runs.items()}
    base = next(iter(runs.values()))
    rows = []
    for name, of in runs.items():
        known = speeds.get(name, {"scheme": name})
        rows.append(known | trained_row(of, base, data_s * known.get("share", 1.0), seed))
    by_name = {row["scheme"]: row for row in rows}
    for preset in presets:
        if preset["scheme"] not in by_name:
            raise InputError(
                f"presets: scheme {preset['scheme']!r}, expected one of {list(by_name)}"
            )
        by_name[preset["scheme"]].update(preset=preset["preset"], command=preset["command"])
    seconds = np.array([row["core_s_data"] + row["core_s_training"] for row in rows])
    percent = np.array([float(row["unseen_percent"]) for row in rows])
    for row, best in zip(rows, pareto(seconds, percent), strict=True):
        row["front"] = "yes" if best else "no"
    return rows + [row for name, row in speeds.items() if name not in runs]


def main(arguments: list[str]) -> None:
    """Write the table from predictions, measured speeds and the times of the data's jobs."""
    line = parser("lowalt.measure.accuracy_cost", __doc__.partition("\n\n")[0])
    line.add_argument(
        "--predictions",
        nargs="+",
        required=True,
        help="predictions of the unseen protocol, all seeds (.csv)",
    )
    line.add_argument(
        "--speeds", nargs="+", required=True, help="files of lowalt.measure.network_speed (.json)"
    )
    line.add_argument(
        "--data-jobs", nargs="+", required=True, help="benchmarks of the data set's jobs (.jsonl)"
    )
    line.add_argument(
        "--index", required=True, help="index of the shards: number of samples, stations"
    )
    line.add_argument("--presets", required=True, help="table of presets (.csv)")
    line.add_argument("--schemes", default=TABLE, help=f"table of schemes (default: {TABLE})")
    line.add_argument("--out", required=True, help="table to write (.csv)")
    options = line.parse_args(arguments)
    (seed,) = pick(options.settings, "seed")
    index = read_object(options.index, "an index of shards")
    presets = read_csv(options.presets, *PRESETS)
    studies = {row["predictions"]: row["scheme"] for row in presets if row["predictions"]}
    by_name: dict[str, list[Evaluated]] = {}
    for path in options.predictions:
        training = Evaluated(path)
        folder = str(Path(path).parent)
        name = next((studies[end] for end in studies if folder.endswith(end)), training.scheme)
        by_name.setdefault(name, []).append(training)
    order = [*names(options.schemes), *studies.values()]
    unknown = sorted(set(by_name) - set(order))
    if unknown:
        raise InputError(
            f"{options.schemes}: no row for {unknown}, expected one for each prediction file"
        )
    runs = {name: by_name[name] for name in order if name in by_name}
    speeds = read_speeds(options.speeds, options.schemes, station_names(index["render"]["network"]))
    data_s = sample_seconds(options.data_jobs, sum(shard["samples"] for shard in index["shards"]))
    rows = table_rows(runs, speeds, presets, data_s, seed)
    cells = []
    for row in rows:
        cells.append([short(row.get(name)) for name in COLUMNS])
    write_csv(options.out, COLUMNS, cells)


if __name__ == "__main__":
    run(main)
