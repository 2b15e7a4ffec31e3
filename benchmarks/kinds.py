"""The cost of each kind of shards, and of samples made on the spot: bytes, time a sample, and a
training's wait.

    python benchmarks/kinds.py --out results/benchmarks/kinds.csv

The same samples in all ways, in one run: image, signal and recipe shards, and `lowalt.Dataset`. The
data set is small and made here: a chunk of ten motion models of eight subtypes at the six SNRs of
the default. Times are processor times of one thread in random order, the least of three passes;
reading includes the check of the sample's SHA-256. `new`: every sample of another motion model, so
that its echoes are computed; otherwise the clean echoes are there, as in a training from its second
epoch on. Then networks are trained for some steps on made samples, with a worker next to the
training; their waiting share is wall time.
"""

import argparse
import copy
import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import yaml

from lowalt.config.classes import CATEGORIES
from lowalt.config.layers import load
from lowalt.files.csv_tables import write_csv
from lowalt.machine.hardware import describe
from lowalt.numerics.streams import stream
from lowalt.recognition.dataset_samples import DatasetSamples
from lowalt.recognition.protocols import folds
from lowalt.recognition.runs import train
from lowalt.recognition.schemes import Scheme
from lowalt.shards import ShardSet
from lowalt.shards.build import write_run
from lowalt.shards.dataset import Dataset
from lowalt.shards.sample_table import KINDS, table_path

COLUMNS = ("what", "bytes_a_sample", "image_ms", "signal_ms", "needs_lowalt", "hardware")
WAITS = ("network", "pixels", "steps", "batch", "workers", "step_ms", "waiting_percent", "hardware")
NEEDS = {
    "image": "no",
    "signal": "no for signals; yes for images",
    "recipe": "yes; without it clean echoes alone",
}
NETWORKS = (("test_resnet", 24), ("resnet18", 64))


def processor_ms(call: Callable[[int], object], numbers: list[int], passes: int = 3) -> float:
    """Processor time of a call (ms), averaged over numbers, each the least of some passes."""
    call(numbers[0])
    found = []
    for _ in range(passes):
        times = []
        for number in numbers:
            start = time.process_time_ns()
            call(number)
            times.append(time.process_time_ns() - start)
        found.append(times)
    return float(np.min(found, axis=0).mean()) / 1e6


def fresh(dataset: Dataset, call: Callable[[int], object]) -> Callable[[int], object]:
    """Return the call with the kept echoes cleared before it, as at the first sample of a motion
    model.
    """

    def run(number: int) -> object:
        """Clear the kept echoes, then make the call."""
        dataset.maker.kept = 1
        dataset.maker._received.clear()
        return call(number)

    return run


def kinds(config: dict, folder: Path, samples: int) -> list[tuple]:
    """Rows of COLUMNS; the run with signal shards stays in the folder."""
    dataset = Dataset(config)
    rows = []
    where = describe()
    numbers = stream(1, "kinds").permutation(len(dataset))[:samples].tolist()
    for kind in KINDS:
        write_run(dataset, folder / kind, kind)
        shards = ShardSet(folder / kind / "shards" / "index.json")
        paths = sorted((folder / kind / "shards").glob("*.tar"))
        size = sum(path.stat().st_size + table_path(path).stat().st_size for path in paths) / len(
            shards
        )
        signal = "" if kind == "image" else f"{processor_ms(shards.signal, numbers):.3f}"
        rows.append(
            (
                f"{kind} shards",
                round(size),
                f"{processor_ms(shards.tile, numbers):.3f}",
                signal,
                NEEDS[kind],
                where,
            )
        )
    dataset.maker.kept = len(dataset)
    for name, wrap in (
        ("Dataset", lambda call: call),
        ("Dataset, new", lambda call: fresh(dataset, call)),
    ):
        images, signals = (
            processor_ms(wrap(call), numbers) for call in (dataset.tile, dataset.signal)
        )
        rows.append((name, 0, f"{images:.3f}", f"{signals:.3f}", "yes", where))
    return rows


def waits(config: dict, folder: Path, steps: int) -> list[tuple]:
    """Rows of WAITS: trainings on made samples, each with one worker next to it."""
    rows = []
    batch = 16
    for backbone, size in NETWORKS:
        scheme = Scheme("ABC:VRP+TRP+VT", (0, 1, 2), (0, 1, 2))
        block = copy.deepcopy(config["recognition"])
        block["network"] |= {"backbone": backbone}
        block["training"] |= {"steps": steps, "validate_every": 10**6, "batch": batch, "workers": 1}
        settings = {key: block[key] for key in ("network", "training", "augmentation")}
        settings |= {
            "seed": 1,
            "size": size,
            "colour_map": config["images"]["colour_map"],
            "classes": list(CATEGORIES),
        }
        sources = {
            part: DatasetSamples(
                Dataset(config), scheme.columns, folds("seen", part), size, placed=False
            )
            for part in ("train", "validation")
        }
        out = folder / f"{backbone}-{size}"
        out.mkdir()
        train(sources, scheme, "seen", settings, out)
        told = json.loads((out / "run.json").read_text())
        step_ms = 1e3 * told["train_s"] * (1 - told["waiting_share"]) / steps
        rows.append(
            (
                backbone,
                size,
                steps,
                batch,
                1,
                round(step_ms),
                f"{100 * told['waiting_share']:.1f}",
                told["hardware"],
            )
        )
    return rows


def main() -> None:
    """Measure and write both tables."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "--samples", type=int, default=60, help="samples timed in each way (default 60)"
    )
    options.add_argument(
        "--steps", type=int, default=20, help="steps of each training (default 20; 0: no training)"
    )
    options.add_argument(
        "--out",
        type=Path,
        required=True,
        help="table of the kinds; that of waiting goes next to it",
    )
    given = options.parse_args()
    config = load(
        ["config/default.yaml", "config/tiny.yaml"], "workflow/schemas/config.schema.yaml"
    )
    config["noise"] = yaml.safe_load(Path("config/default.yaml").read_text())["noise"]
    with tempfile.TemporaryDirectory() as name:
        rows = kinds(config, Path(name), given.samples)
        for row in rows:
            print(*row, sep="  ")
        write_csv(given.out, COLUMNS, rows)
        if given.steps:
            rows = waits(config, Path(name), given.steps)
            for row in rows:
                print(*row, sep="  ")
            write_csv(given.out.with_name(f"{given.out.stem}_waits.csv"), WAITS, rows)


if __name__ == "__main__":
    main()
