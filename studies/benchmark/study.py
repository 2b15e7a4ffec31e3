"""The baselines of the benchmark: trained, tested on every track, and written into its table.

    python studies/benchmark/study.py [--methods NAME ...] [--tracks NAME ...] [--seeds 0 1 2]
    [--table | --confirm]

Each training is tested on all tracks that it serves, and finished ones are kept in
results/lowalt-40-v1-baselines, so that an interrupted study goes on where it was. The table and
what each baseline got right are written at the end of every call; `--table` trains nothing. Rows
are merged by track, method and training seed: a row of the kept table is replaced once all its
seeds are finished here, and stays otherwise; a method that the table lacks enters it once it is
finished on all tracks of the table. `--confirm` trains each method once for the tracks named,
freezes it, and writes its confirmed result into the table; of the methods of ZOO_ENTRIES it keeps
the model in the zoo.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

# The modules that studies share lie in the folder above, and those of this study beside this file.
sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))

import confirmations
import kept_results
import numpy as np
from methods import CHOSEN_ON, KEPT, METHODS, SEEDLESS, Given
from signals import cost_s

import trainings
from lowalt.config.blocks import render_blocks
from lowalt.config.command import run
from lowalt.extensions.benchmark import baseline_table, scoring
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, UNKNOWN, Track, named
from lowalt.extensions.benchmark.confirm import Confirmed, confirm
from lowalt.extensions.benchmark.definition import MAIN, PARTS, REFERENCE, RUN, config_of, run_name
from lowalt.extensions.benchmark.part_samples import TrackSamples
from lowalt.extensions.formats.zoo import kept as keep
from lowalt.extensions.formats.zoo_files import ZOO
from lowalt.files.atomic import replacing, slug
from lowalt.machine.hardware import describe
from lowalt.recognition import model_file
from lowalt.recognition.predictions import Predictions

OUT = Path(f"results/{RUN}-baselines")
FIRST = "majority class"
"""A new table has the tracks on which this method is finished."""
ZOO_ENTRIES = {("unseen", "small CNN on images"): f"{RUN}-unseen"}
"""Rows that are confirmed with a model of the zoo: its name by track and method."""


def closed(samples: TrackSamples) -> TrackSamples:
    """Return samples as a training sees them: in the track open-set without the class that is held
    out.
    """
    if samples.track.headline == "accuracy":
        return samples
    kept = [name for name in samples.classes if name != UNKNOWN]
    # A test sample of the class that is held out has no label here; no method reads the labels of a
    # test.
    names = {
        label: kept.index(name) if name in kept else -1
        for label, name in enumerate(samples.classes)
    }
    result = copy(samples)
    result.facts = replace(
        samples.facts, label=np.array([names[label] for label in samples.labels.tolist()])
    )
    result.classes = tuple(kept)
    return result


def opened(samples: TrackSamples, shares: np.ndarray) -> np.ndarray:
    """Return probabilities (samples, classes) of all classes of a track; shares: of those that
    trained.

    The class that is held out gets one minus the largest share, the usual baseline of open-set
    recognition.
    Source: Hendrycks and Gimpel, A Baseline for Detecting Misclassified and Out-of-Distribution
    Examples, ICLR 2017.
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
    """Return the core-seconds per sample of what a method sees of its signals, where that is kept;
    else 0.
    """
    kept = KEPT.get(method.split()[-1])
    return cost_s(OUT / "features", kept.of, samples.run.name) if kept else 0.0


def one(job: tuple[str, str, int], data: str) -> Path:
    """Train a method for a track, test it on all tracks that this serves, and keep its answers."""
    method, name, seed = job
    folder = place(method, name, seed)
    track = named(name)
    if (folder / "tested.json").is_file():
        return folder
    parts = [closed(TrackSamples(track, part, data)) for part in ("train", "validation")]
    given = Given(*parts, parts[0].classes, seed, folder, OUT / "features", config_of(MAIN))
    begun = time.process_time()
    answer = METHODS[method](given)
    trained_s = time.process_time() - begun + len(parts[0]) * told_s(method, parts[0])
    facts = {
        "method": method,
        "seed": seed,
        "train_core_s": trained_s,
        "hardware": describe(),
        "test_core_s": {},
    }
    found = {}
    for tested in served(name):
        samples = TrackSamples(tested, "test", data)
        begun = time.process_time()
        shares = answer.of(closed(samples), given.features)
        spent = time.process_time() - begun + len(samples) * told_s(method, samples)
        facts["test_core_s"][tested.name] = spent
        found[tested.name] = opened(samples, shares).astype(np.float32)
        found[f"{tested.name} key"] = samples.key
    with replacing(folder / "answers.npz") as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **found)
    with replacing(folder / "tested.json") as temporary:
        temporary.write_text(json.dumps(facts, indent=1) + "\n")
    print(f"{folder}: {trained_s:.0f} core-s", flush=True)
    return folder


def finished(method: str, track: Track) -> Iterator[tuple[dict, Predictions]]:
    """Yield the record and the predictions of each finished training of a method that serves a
    track.
    """
    facts = track.samples().facts
    for seed in range(100):
        folder = place(method, track.trains_as, seed)
        if (folder / "tested.json").is_file():
            with np.load(folder / "answers.npz", allow_pickle=False) as data:
                number = {
                    key: place for place, key in enumerate(data[f"{track.name} key"].tolist())
                }
                shares = data[track.name].astype(float)[[number[key] for key in facts.key.tolist()]]
            about = json.loads((folder / "tested.json").read_text())
            # A call that finds the network trained measures no training; `runs.train` has kept its
            # time.
            if (folder / "run.json").is_file():
                training_s = json.loads((folder / "run.json").read_text())["train_processor_s"]
                about["train_core_s"] = max(about["train_core_s"], training_s)
            yield about, scoring.tested(track, facts, shares)


def row_of(track: Track, method: str, runs: list[tuple[dict, Predictions]]) -> dict:
    """Return a method's row of the table, without its group and what follows from the kept values."""
    about, parts = zip(*runs, strict=True)
    found = scoring.scores(track, [part.probabilities for part in parts], {})
    names = ("percent", "low", "high"), ("macro_f1_percent", "macro_f1_low", "macro_f1_high")
    values = found["percent"], found["macro_f1_percent"]
    cells = {}
    for columns, interval in zip(names, values, strict=True):
        cells |= dict(zip(columns, interval, strict=True))
    test_s = np.mean([one["test_core_s"][track.name] for one in about])
    return {
        "track": track.name,
        "method": method,
        "seeds": "none" if method in SEEDLESS else len(parts),
        **cells,
        "train_core_s": float(np.mean([one["train_core_s"] for one in about])),
        "test_core_s_per_1000": float(1000 * test_s / len(parts[0])),
        "hardware": about[0]["hardware"],
    }


def replaced(track: Track, out: Path) -> dict[str, list[tuple[dict, Predictions]]]:
    """Return the finished trainings of the methods whose rows of a track are new: seed by seed, by
    method.

    A row of the kept table is new once all its seeds are finished. A method that the table lacks is
    new once it is finished on all tracks of the table.
    """
    kept = kept_rows(out)
    shown = {name for name, _ in kept} or {
        track.name for track in TRACKS.values() if _done(FIRST, track)
    }
    found = {}
    for method in METHODS:
        runs = list(finished(method, track)) if _done(method, track) else []
        known = kept.get((track.name, method))
        if known is None:
            complete = all(_done(method, TRACKS[name]) for name in shown)
            fresh = bool(runs) and complete
        else:
            fresh = len(runs) >= (1 if known["seeds"] == "none" else int(known["seeds"]))
        if fresh:
            found[method] = runs
    return found


def _done(method: str, track: Track) -> bool:
    """Whether a method's training with seed 0 that serves a track is finished."""
    return (place(method, track.trains_as, 0) / "tested.json").is_file()


def tables(out: Path) -> list[dict]:
    """Write what is kept of all trainings, and return the rows of the table: finished here, or kept
    before.
    """
    rows = []
    kept = kept_rows(out)
    for track in TRACKS.values():
        runs = replaced(track, out)
        classes = track.truth().classes
        arrays = kept_results.read_values(track, out)
        for method, one in runs.items():
            arrays[method] = kept_results.packed(track, [part for _, part in one], classes)
        arrays = {method: arrays[method] for method in METHODS if method in arrays}
        if not arrays:
            continue
        weight, subtypes = scoring.models_of(track, *track.samples())
        values = {name: kept_results.unpacked(array, weight) for name, array in arrays.items()}
        numbers = kept_results.groups(track, weight, subtypes, values)
        for method in arrays:
            row = (
                row_of(track, method, runs[method]) if method in runs else kept[track.name, method]
            )
            row |= {"group": numbers[method], "chosen_on": CHOSEN_ON.get(method, "validation")}
            if track.whole:
                row |= baseline_table.by_subtype(values[method], weight, subtypes)
            rows.append(row)
        kept_results.write_values(track, arrays, out)
    return rows


def kept_rows(out: Path) -> dict[tuple[str, str], dict]:
    """Return the rows of the table that is already there, by track and method; `percent` as a
    number.
    """
    rows = baseline_table.read(out) if (out / baseline_table.TABLE).is_file() else []
    return {(row["track"], row["method"]): row | {"percent": float(row["percent"])} for row in rows}


def with_confirmed(rows: list[dict], out: Path) -> list[dict]:
    """Return the rows with the confirmed results that the table has already."""
    kept = kept_rows(out)
    found = []
    for row in rows:
        known = kept.get((row["track"], row["method"]), {})
        found.append(
            row | {name: known[name] for name in baseline_table.CONFIRMED if name in known}
        )
    return found


def confirmed_by_zoo(name: str, method: str, data: str, zoo: Path) -> Confirmed:
    """Keep the first training of a method as a model of the zoo, and return its confirmed result."""
    entry = ZOO_ENTRIES[name, method]
    track = named(name)
    model = place(method, name, 0) / "model.safetensors"
    content = replace(model_file.of_run(model), input=render_blocks(config_of(MAIN)))
    keep(content, model, TrackSamples(track, "validation", data), entry, zoo)
    return confirm(zoo / f"{entry}.safetensors", track)


def confirmed(job: tuple[str, str], data: str, zoo: Path) -> Confirmed:
    """Train a method once for a track unless that is done, freeze it, and return its confirmed
    result.
    """
    method, name = job
    folder = OUT / f"confirmed/{slug(method)}/{name}"
    track = named(name)
    if found := confirmations.kept_result(folder):
        return found
    parts = [closed(TrackSamples(track, part, data)) for part in ("train", "validation")]
    training = place(method, name, 0)
    given = Given(*parts, parts[0].classes, 0, training, OUT / "features", config_of(MAIN))
    trained = METHODS[method](given)
    if (name, method) in ZOO_ENTRIES:
        found = confirmed_by_zoo(name, method, data, zoo)
        confirmations.keep(found, folder)
        return found
    confirmations.frozen(method, track, trained, training, given.features, folder)
    return confirmations.result(folder, track)


def write_confirmed(jobs: list[tuple[str, str]], data: str, out: Path) -> None:
    """Confirm methods (method, track) one after the other, and write each result into the table as
    it comes.
    """
    for method, name in jobs:
        found = confirmed((method, name), data, ZOO)
        print(
            f"{name}, {method}: confirmed at {baseline_table.words(found.percent)} %,"
            f" {found.sha256}",
            flush=True,
        )
        rows = kept_rows(out)
        if (name, method) in rows:
            cells = dict(zip(baseline_table.CONFIRMED, (*found.percent, found.sha256), strict=True))
            rows[name, method] |= cells
            kept_results.write_table(list(rows.values()), out)


def main(arguments: list[str]) -> None:
    """Train what is missing, and write the table, what is kept and the document."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    trained = [name for name, track in TRACKS.items() if track.part == MAIN]
    line.add_argument(
        "--methods", nargs="+", choices=list(METHODS), default=list(METHODS), metavar="NAME"
    )
    line.add_argument(
        "--tracks", nargs="+", choices=trained, default=trained, metavar="NAME", help="to train for"
    )
    line.add_argument(
        "--seeds", type=int, nargs="+", default=[0, 1, 2], help="training seeds (default: 0 1 2)"
    )
    line.add_argument(
        "--data", default="results", help="folder of the benchmark's runs (default: results)"
    )
    line.add_argument("--workers", type=int, help="trainings side by side (default: the cores)")
    line.add_argument("--table", action="store_true", help="train nothing, write the table")
    line.add_argument(
        "--confirm", action="store_true", help="confirm the methods on the tracks, such as unseen"
    )
    given = line.parse_args(arguments)
    out = Path(REFERENCE)
    # Threads of OpenMP spin while they wait for each other, and that would count as processor time.
    os.environ["OMP_NUM_THREADS"] = "1"
    if given.confirm:
        known = kept_rows(out)
        jobs = [
            (method, name)
            for name in given.tracks
            for method in given.methods
            if (name, method) in known
        ]
        write_confirmed(jobs, given.data, out)
        return
    jobs = [
        (method, track, seed)
        for seed, method, track in product(given.seeds, given.methods, given.tracks)
        if seed == 0 or method not in SEEDLESS
    ]
    if not given.table:
        for word in sorted({method.split()[-1] for method in given.methods} & set(KEPT)):
            kept = KEPT[word]
            paths = sorted(
                path for part in PARTS for path in Path(given.data, run_name(part)).glob(kept.files)
            )
            trainings.side_by_side(
                partial(kept.make, folder=OUT / "features"), paths, given.workers
            )
        trainings.side_by_side(partial(one, data=given.data), jobs, given.workers)
    rows = with_confirmed(tables(out), out)
    kept_results.write_table(rows, out)
    print(f"{out / baseline_table.TABLE}: {len(rows)} rows", *kept_results.alike(rows), sep="\n")


if __name__ == "__main__":
    run(main)
