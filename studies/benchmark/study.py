"""The baselines of the benchmark: trained, tested on every track, and written into its table.

    python studies/benchmark/study.py [--methods NAME ...] [--tracks NAME ...] [--seeds 0 1 2] [--table | --confirm]

Each training is tested on all tracks that it serves, and finished ones are kept in results/lowalt-40-v1-baselines, so
that an interrupted study goes on where it was. The table and what each baseline got right are written at the end of
every call, of the methods that are finished on all tracks of the table; `--table` trains nothing. `--confirm` keeps the
first training of each method of CONFIRMED in the zoo, and writes its confirmed result into the table.
"""

import argparse
import json
import os
import time
from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import kept_results
import numpy as np
from methods import KEPT, METHODS, SEEDLESS, Given
from signals import cost_s

import trainings
from lowalt.config.command import run
from lowalt.extensions.benchmark import baseline_table, scoring
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, UNKNOWN, Track, named
from lowalt.extensions.benchmark.confirm import confirm
from lowalt.extensions.benchmark.definition import MAIN, PARTS, REFERENCE, RUN, config_of, run_name
from lowalt.extensions.benchmark.part_samples import TrackSamples
from lowalt.files.atomic import replacing, slug
from lowalt.machine.hardware import describe
from lowalt.recognition import model_file
from lowalt.recognition.predictions import Predictions
from lowalt.recognition.zoo import kept as keep
from lowalt.recognition.zoo_files import ZOO

OUT = Path(f"results/{RUN}-baselines")
FIRST = "majority class"
"""The table has the tracks on which this method is finished, and the methods that are finished on all of them."""
CONFIRMED = {("unseen", "small CNN on images"): f"{RUN}-unseen"}
"""Rows with a confirmed result: the name of the model in the zoo by track and method."""


def closed(samples: TrackSamples) -> TrackSamples:
    """Return samples as a training sees them: in the track open-set without the class that is held out."""
    if samples.track.headline == "accuracy":
        return samples
    kept = [name for name in samples.classes if name != UNKNOWN]
    # A test sample of the class that is held out has no label here; no method reads the labels of a test.
    names = {label: kept.index(name) if name in kept else -1 for label, name in enumerate(samples.classes)}
    result = copy(samples)
    result.facts = replace(samples.facts, label=np.array([names[label] for label in samples.labels.tolist()]))
    result.classes = tuple(kept)
    return result


def opened(samples: TrackSamples, shares: np.ndarray) -> np.ndarray:
    """Return probabilities (samples, classes) of all classes of a track; shares: of those that trained.

    The class that is held out gets one minus the largest share, the usual baseline of open-set recognition.
    Source: Hendrycks and Gimpel, A Baseline for Detecting Misclassified and Out-of-Distribution Examples, ICLR 2017.
    """
    if samples.track.headline == "accuracy":
        return shares
    unknown = 1 - shares.max(1, keepdims=True)
    return np.insert(shares * (1 - unknown), samples.classes.index(UNKNOWN), unknown[:, 0], axis=1)


def served(name: str) -> list[Track]:
    """Return the tracks that a training of this track is tested on."""
    return [track for track in TRACKS.values() if track.trains_as == name]


def place(method: str, name: str, seed: int) -> Path:
    """Return the folder of a training of a track."""
    return OUT / f"{slug(method)}/{name}/{seed}"


def told_s(method: str, samples: TrackSamples) -> float:
    """Return the core-seconds per sample of what a method sees of its signals, where that is kept; else 0."""
    kept = KEPT.get(method.split()[-1])
    return cost_s(OUT / "features", kept.of, samples.run.name) if kept else 0.0


def one(job: tuple[str, str, int], data: str) -> Path:
    """Train a method for a track, test it on all tracks that this serves, and keep its answers."""
    method, name, seed = job
    folder, track = place(method, name, seed), named(name)
    if (folder / "tested.json").is_file():
        return folder
    parts = [closed(TrackSamples(track, part, data)) for part in ("train", "validation")]
    given = Given(*parts, parts[0].classes, seed, folder, OUT / "features", config_of(MAIN))
    begun = time.process_time()
    answer = METHODS[method](given)
    trained_s = time.process_time() - begun + len(parts[0]) * told_s(method, parts[0])
    facts = {"method": method, "seed": seed, "train_core_s": trained_s, "hardware": describe(), "test_core_s": {}}
    found = {}
    for tested in served(name):
        samples = TrackSamples(tested, "test", data)
        begun = time.process_time()
        shares = answer(closed(samples))
        spent = time.process_time() - begun + len(samples) * told_s(method, samples)
        facts["test_core_s"][tested.name] = spent
        found[tested.name] = opened(samples, shares).astype(np.float32)
    with replacing(folder / "answers.npz") as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **found)
    with replacing(folder / "tested.json") as temporary:
        temporary.write_text(json.dumps(facts, indent=1) + "\n")
    print(f"{folder}: {trained_s:.0f} core-s", flush=True)
    return folder


def finished(method: str, track: Track) -> Iterator[tuple[dict, Predictions]]:
    """Yield the record and the predictions of each finished training of a method that serves a track."""
    facts = track.samples().facts
    for seed in range(100):
        folder = place(method, track.trains_as, seed)
        if (folder / "tested.json").is_file():
            with np.load(folder / "answers.npz", allow_pickle=False) as data:
                shares = data[track.name].astype(float)
            about = json.loads((folder / "tested.json").read_text())
            # A call that finds the network trained measures no training; `runs.train` has kept its time.
            if (folder / "run.json").is_file():
                training_s = json.loads((folder / "run.json").read_text())["train_processor_s"]
                about["train_core_s"] = max(about["train_core_s"], training_s)
            yield about, scoring.tested(track, facts, shares)


def row_of(track: Track, method: str, runs: list[tuple[dict, Predictions]], group: int) -> dict:
    """Return a method's row of the table."""
    about, parts = zip(*runs, strict=True)
    found = scoring.scores(track, [part.probabilities for part in parts], {})
    names = ("percent", "low", "high"), ("macro_f1_percent", "macro_f1_low", "macro_f1_high")
    values = found["percent"], found["macro_f1_percent"]
    cells = {}
    for columns, interval in zip(names, values, strict=True):
        cells |= dict(zip(columns, interval, strict=True))
    test_s = np.mean([one["test_core_s"][track.name] for one in about])
    return {
        "track": track.name, "method": method, "seeds": "none" if method in SEEDLESS else len(parts),
        **cells, "group": group, "train_core_s": float(np.mean([one["train_core_s"] for one in about])),
        "test_core_s_per_1000": float(1000 * test_s / len(parts[0])), "hardware": about[0]["hardware"],
    }  # fmt: skip


def tables(out: Path) -> list[dict]:
    """Write what is kept of all finished trainings, and return the rows of the table."""
    rows, complete = [], [
        method for method in METHODS if all(place(method, track.trains_as, 0).joinpath("tested.json").is_file()
                                            for track in shown_tracks())
    ]  # fmt: skip
    for track in shown_tracks():
        runs = {method: list(finished(method, track)) for method in complete}
        classes = track.truth().classes
        found = {method: scoring.values_of(track, [part for _, part in one], classes) for method, one in runs.items()}
        if not found:
            continue
        first = next(iter(found.values()))
        values = {name: one.values for name, one in found.items()}
        numbers = kept_results.groups(track, first.weight, first.subtypes, values)
        rows += [row_of(track, method, one, numbers[method]) for method, one in runs.items()]
        arrays = {name: kept_results.packed(track, [part for _, part in one], classes) for name, one in runs.items()}
        kept_results.write_values(track, arrays, out)
    return rows


def shown_tracks() -> list[Track]:
    """Return the tracks of the table: those on which the first method is finished."""
    return [track for track in TRACKS.values()
            if (place(FIRST, track.trains_as, 0) / "tested.json").is_file()]  # fmt: skip


def kept_rows(out: Path) -> dict[tuple[str, str], dict]:
    """Return the rows of the table that is already there, by track and method."""
    rows = baseline_table.read(out) if (out / baseline_table.TABLE).is_file() else []
    return {(row["track"], row["method"]): row for row in rows}


def with_confirmed(rows: list[dict], out: Path) -> list[dict]:
    """Return the rows with the confirmed results that the table has already."""
    kept, names = kept_rows(out), ("confirmed_percent", "confirmed_low", "confirmed_high")
    return [row | {name: kept[row["track"], row["method"]][name] for name in names}
            if (row["track"], row["method"]) in kept else row for row in rows]  # fmt: skip


def confirmed(rows: list[dict], data: str, zoo: Path) -> list[dict]:
    """Keep the models of CONFIRMED in a zoo, and return the rows with their confirmed results."""
    for (name, method), entry in CONFIRMED.items():
        model, config = place(method, name, 0) / "model.safetensors", config_of(MAIN)
        content = replace(model_file.of_run(model), input={block: config[block] for block in model_file.INPUT})
        keep(content, model, TrackSamples(named(name), "validation", data), entry, zoo)
        found = confirm(zoo / f"{entry}.safetensors", named(name)).percent
        print(f"{name}, {method}: {entry} confirmed at {baseline_table.words(found)} %")
        cells = dict(zip(("confirmed_percent", "confirmed_low", "confirmed_high"), found, strict=True))
        rows = [row | cells if (row["track"], row["method"]) == (name, method) else row for row in rows]
    return rows


def main(arguments: list[str]) -> None:
    """Train what is missing, and write the table, what is kept and the document."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    trained = [name for name, track in TRACKS.items() if track.part == MAIN]
    line.add_argument("--methods", nargs="+", choices=list(METHODS), default=list(METHODS), metavar="NAME")
    line.add_argument("--tracks", nargs="+", choices=trained, default=trained, metavar="NAME", help="to train for")
    line.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="training seeds (default: 0 1 2)")
    line.add_argument("--data", default="results", help="folder of the benchmark's runs (default: results)")
    line.add_argument("--workers", type=int, help="trainings side by side (default: the cores)")
    line.add_argument("--table", action="store_true", help="train nothing, write the table")
    line.add_argument("--confirm", action="store_true", help="train nothing, confirm results of the kept table")
    given, out = line.parse_args(arguments), Path(REFERENCE)
    if given.confirm:
        rows = [{**row, "percent": float(row["percent"])} for row in kept_rows(out).values()]
        kept_results.write_table(confirmed(rows, given.data, ZOO), out)
        return
    # Threads of OpenMP spin while they wait for each other, and that would count as processor time.
    os.environ["OMP_NUM_THREADS"] = "1"
    jobs = [(method, track, seed) for seed, method, track in product(given.seeds, given.methods, given.tracks)
            if seed == 0 or method not in SEEDLESS]  # fmt: skip
    if not given.table:
        for word in sorted({method.split()[-1] for method in given.methods} & set(KEPT)):
            kept = KEPT[word]
            paths = sorted(path for part in PARTS for path in Path(given.data, run_name(part)).glob(kept.files))
            trainings.side_by_side(partial(kept.make, folder=OUT / "features"), paths, given.workers)
        trainings.side_by_side(partial(one, data=given.data), jobs, given.workers)
    rows = with_confirmed(tables(out), out)
    kept_results.write_table(rows, out)
    print(f"{out / baseline_table.TABLE}: {len(rows)} rows", *kept_results.alike(rows), sep="\n")


if __name__ == "__main__":
    run(main)
