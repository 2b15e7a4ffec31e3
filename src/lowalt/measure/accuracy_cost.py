"""Recognition accuracy over time: trained schemes with their measured times, and networks that were only timed.

    python -m lowalt.measure.accuracy_cost --settings JSON --predictions a.csv ... --speeds a.json ...
        --index index.json --fidelity transfer.csv --out accuracy_cost.csv

Settings: seed. accuracy_cost.csv, one row a scheme and SNR ("avg": mean over the SNRs):
    kind                 trained: accuracy and times measured; timed: times of a network that was not trained, without
                         accuracy, its core_s_training extrapolated from the time of one step; fidelity: the first
                         scheme trained on echoes at a tolerance and tested on exact ones
    backbone, pixels, stations, spectra, steps, train_samples, parameters    of the scheme
    seen_percent         held-out motion models of the trained subtypes, mean over the training seeds
    unseen_percent       subtypes never trained on, likewise
    difference_points    unseen less that of the first scheme (fidelity: of training on exact echoes)
    low, high            its 95 % interval, which resamples training seeds, subtypes and motion models
    inference_ms_1, inference_ms_64    of one sample on one core in batches of 1 and 64, images in memory
    train_ms             of one sample of a training step on one core, images in memory
    core_s_training      processor time of the whole training, validation included; mean over the seeds
    network_bytes        bytes of images, signals or features a sample that the network takes in; shard_bytes: bytes a
                         sample in the shards
    seeds, spread_points training seeds, and the standard deviation of unseen accuracy between them
    front                the rows of an SNR that no other beats in unseen accuracy at equal or less inference_ms_64
"""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.config.network import station_names
from lowalt.files.atomic import text_of
from lowalt.files.csv_tables import read_csv, short, write_csv
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.recognition.compared import difference, spread_points
from lowalt.recognition.evaluated import Evaluated
from lowalt.recognition.schemes import SPECTRA, TABLE, Scheme, joined, named, names
from lowalt.recognition.statistics import accuracy_by, pareto
from lowalt.recognition.tables import snr_text

COLUMNS = (
    "scheme", "kind", "backbone", "pixels", "stations", "spectra", "steps", "train_samples", "parameters", "snr_db",
    "seen_percent", "unseen_percent", "difference_points", "low", "high", "inference_ms_1", "inference_ms_64",
    "train_ms", "core_s_training", "network_bytes", "shard_bytes", "front", "hardware", "seeds",
    "spread_points",
)  # fmt: skip
TRANSFER = (
    "protocol", "scheme", "trained_on", "snr_db", "accuracy_percent", "difference_points", "low", "high", "hardware",
    "seeds", "spread_points",
)  # fmt: skip
"""Columns of a transfer table that are used here."""


def read_speeds(paths: list[str | Path]) -> dict[str, dict]:
    """Return what `network_speed.measure` found, by scheme.

    Raises: InputError for a file that is no such record.
    """
    found = {}
    for path in paths:
        try:
            entry = json.loads(text_of(path, "speed"))
            found[entry["scheme"]] = {
                key: entry[key] for key in ("size", "parameters", "inference_ms_1", "inference_ms_64", "train_ms",
                                            "batch", "steps", "backbone", "hardware")}  # fmt: skip
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"{path}: not a record of speed ({error!r})") from error
    return found


class Entry(NamedTuple):
    """A scheme with its measured times; `stations` as the table of schemes writes them."""

    scheme: Scheme
    stations: str
    speed: dict
    shard_bytes: float


def entries(
    table: str | Path, stations: Sequence[str], speeds: dict[str, dict], shard_bytes: float
) -> dict[str, Entry]:
    """Return the entry of every scheme with a speed, by name, in the order of `speeds`.

    table: table of schemes; stations: names of the network's stations, in its order.
    Raises: InputError for a scheme that the table lacks, or that names another station.
    """
    found = {}
    for name, speed in speeds.items():
        scheme = named(table, name, stations)
        names_joined = joined([stations[number] for number in scheme.stations])
        found[name] = Entry(scheme, names_joined, speed, shard_bytes)
    return found


def _input_bytes(scheme: Scheme, size: int) -> int:
    """Bytes a sample that a scheme takes in: index images of `size` pixels."""
    return len(scheme.columns) * size * size


def _what(entry: Entry) -> dict:
    """The columns that describe a scheme and its network, whatever the SNR."""
    scheme, stations, speed, shard_bytes = entry
    spectra = "+".join(SPECTRA[number] for number in scheme.spectra)
    return {
        "scheme": scheme.name, "backbone": speed["backbone"], "pixels": speed["size"], "spectra": spectra,
        "stations": stations, "steps": speed["steps"],
        "parameters": speed["parameters"], "inference_ms_1": speed["inference_ms_1"],
        "inference_ms_64": speed["inference_ms_64"], "train_ms": speed["train_ms"],
        "network_bytes": _input_bytes(scheme, speed["size"]), "shard_bytes": shard_bytes,
        "hardware": speed["hardware"],
    }  # fmt: skip


def _shares(run: Evaluated, part: str) -> dict[str, float]:
    """Accuracy in percent by SNR label, and their mean "avg"; empty where the part has no samples."""
    found = run.part(part)
    table = {snr_text(snr): 100 * share for snr, (share, _) in accuracy_by(found.snr_db, found.correct).items()}
    return {**table, "avg": float(np.mean(list(table.values())))} if table else {}


def trained_rows(runs: list[Evaluated], base: list[Evaluated], entry: Entry, seed: int) -> list[dict]:
    """Return one row an SNR and one for their average of a trained scheme, compared with `base` on the same samples.

    runs, base: trainings of the scheme and of the first scheme, one a seed. Raises: as `compared.difference`.
    """
    about = runs[0].about
    same = {
        **_what(entry), "kind": "trained", "steps": about["steps"], "train_samples": about["train_samples"],
        "core_s_training": float(np.mean([run.about["train_processor_s"] for run in runs])), "seeds": len(runs),
    }  # fmt: skip
    seen, unseen = ([_shares(run, part) for run in runs] for part in ("seen_test", "test"))
    rows = []
    for snr in unseen[0]:
        generator = stream(seed, "price", runs[0].scheme, snr)
        interval = difference(runs, base, generator, None if snr == "avg" else float(snr))
        points, low, high = (100 * value for value in interval)
        reached = [shares[snr] for shares in unseen]
        found = {"snr_db": snr, "unseen_percent": float(np.mean(reached)), "spread_points": spread_points(reached)}
        if snr in seen[0]:
            found["seen_percent"] = float(np.mean([shares[snr] for shares in seen]))
        rows.append({**same, **found, "difference_points": points, "low": low, "high": high})
    return rows


def timed_row(entry: Entry) -> dict:
    """Return the row of a network that was timed and not trained; core_s_training counts all steps of its settings."""
    return {
        **_what(entry), "kind": "timed", "snr_db": "avg",
        "core_s_training": entry.speed["train_ms"] / 1e3 * entry.speed["steps"] * entry.speed["batch"],
    }  # fmt: skip


def fidelity_rows(path: str | Path) -> list[dict]:
    """Return the rows of a transfer table's unseen protocol: models of other data, tested on this run's data."""
    rows = [row for row in read_csv(path, *TRANSFER) if row["protocol"] == "unseen"]
    return [
        {"scheme": f"{row['scheme']} trained on {row['trained_on']}", "kind": "fidelity", "snr_db": row["snr_db"],
         "unseen_percent": float(row["accuracy_percent"]), "hardware": row["hardware"],
         "seeds": row["seeds"], "spread_points": row["spread_points"],
         **{name: float(row[name]) for name in ("difference_points", "low", "high")}}
        for row in rows
    ]  # fmt: skip


def mark_front(rows: list[dict]) -> None:
    """Mark in every SNR's trained rows those that no other beats in unseen accuracy over inference time."""
    for snr in {row["snr_db"] for row in rows}:
        group = [row for row in rows if row["snr_db"] == snr and row["kind"] == "trained"]
        cost = np.array([_or_nan(row["inference_ms_64"]) for row in group])
        value = np.array([row["unseen_percent"] for row in group])
        for row, best in zip(group, pareto(cost, value) if group else (), strict=True):
            row["front"] = "yes" if best else "no"


def _or_nan(value: float | None) -> float:
    """The value, NaN for None."""
    return math.nan if value is None else value


def write(
    runs: list[Evaluated], order: list[str], timed: dict[str, Entry], fidelity: list[dict], out: str | Path, seed: int
) -> None:  # fmt: skip
    """Write accuracy_cost.csv: trained schemes in `order`, then those only timed, then `fidelity` rows.

    order: names of the table of schemes; timed: as `entries` gives it.
    Raises: InputError for a run without a scheme or a speed.
    """
    by_name: dict[str, list[Evaluated]] = {}
    for one in sorted(runs, key=lambda one: one.seed):
        by_name.setdefault(one.scheme, []).append(one)
    order = [name for name in order if name in by_name]
    lacking = sorted(set(by_name) - set(order)) or sorted(set(order) - set(timed))
    if lacking or not order:
        raise InputError(f"{lacking}: no row in the table of schemes, or no record of speed")
    base = by_name[order[0]]
    counts = {name: len(by_name[name]) for name in order}
    if len(set(counts.values())) > 1:
        raise InputError(f"trainings a scheme: {counts}, expected as many seeds of each")
    rows: list[dict] = []
    for name in order:
        rows += trained_rows(by_name[name], base, timed[name], seed)
    rows += [timed_row(entry) for name, entry in timed.items() if name not in by_name]
    mark_front(rows)
    write_csv(out, COLUMNS, [[short(row.get(name)) for name in COLUMNS] for row in rows + fidelity])


def main(arguments: list[str]) -> None:
    """Write the table from predictions and measured speeds."""
    options = parser("lowalt.measure.accuracy_cost", __doc__.splitlines()[0])
    options.add_argument(
        "--predictions", nargs="+", required=True, help="predictions of the unseen protocol, all seeds (.csv)"
    )
    options.add_argument("--speeds", nargs="+", required=True, help="files of lowalt.measure.network_speed (.json)")
    options.add_argument("--index", required=True, help="index of the shards: bytes a sample")
    options.add_argument("--fidelity", help="transfer.csv of models trained on echoes at a tolerance")
    options.add_argument("--schemes", default=TABLE, help=f"table of schemes (default: {TABLE})")
    options.add_argument("--out", required=True, help="table to write (.csv)")
    given = options.parse_args(arguments)
    (seed,) = pick(given.settings, "seed")
    index = json.loads(text_of(given.index, "index"))
    shards, stations = index["shards"], station_names(index["render"]["network"])
    size = sum(shard["bytes"] for shard in shards) / sum(shard["samples"] for shard in shards)
    runs, speeds = [Evaluated(path) for path in given.predictions], read_speeds(given.speeds)
    fidelity = fidelity_rows(given.fidelity) if given.fidelity else []
    timed = entries(given.schemes, stations, speeds, size)
    write(runs, names(given.schemes), timed, fidelity, given.out, seed)


if __name__ == "__main__":
    run(main)
