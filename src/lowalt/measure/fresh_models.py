"""Accuracy against distinct motion models, steps and size of the network: `python -m lowalt.measure.fresh_models`.

Each candidate of a table trains once on a stream (`lowalt.recognition.stream`), in this process and one after the
other, and is judged on validation data alone, as `lowalt.recognition.choose` judges. Fresh samples are kept in memory
for the candidates after it. The table has two processor times: of the training with samples in memory, and of making
the distinct samples that the candidate saw.
"""

import json
import shutil
import time
from pathlib import Path

import numpy as np

from lowalt.common.command import parser, run
from lowalt.common.csv_tables import write_csv
from lowalt.common.files import slug
from lowalt.common.hardware import describe
from lowalt.common.shipped import located
from lowalt.common.streams import stream as generator_of
from lowalt.common.yaml_files import load_yaml
from lowalt.recognition import choose, predictions, runs
from lowalt.recognition.intervals import bootstrap
from lowalt.recognition.made import opened
from lowalt.recognition.recipe import OPTIONAL
from lowalt.recognition.samples import ViewSamples, joined_sources
from lowalt.recognition.schemes import named
from lowalt.recognition.stream import Stream, Streamed
from lowalt.recognition.trial import part_of

COLUMNS = (
    "candidate", "motion_models", "steps", "parameters", "train_core_s", "make_core_s", "held_percent", "held_low",
    "held_high", "kept_percent", "kept_low", "kept_high", "hardware",
)  # fmt: skip
FOLD = 0


class Remembered(Stream):
    """A stream whose images are kept for other streams of the same subtypes, with the time that making them took."""

    shared: dict[tuple, np.ndarray]
    cost: dict[str, float]

    def _images(self, place: tuple) -> np.ndarray:
        """Return the images of one sample, made once for all streams."""
        if place not in self.shared:
            start = time.process_time()
            self.shared[place] = super()._images(place)
            self.cost["samples"] += 1
            self.cost["s"] += time.process_time() - start
        return self.shared[place]


def _told(path: Path, held: list[str]) -> dict[str, tuple[float, float, float]]:
    """Return the accuracy (%) of held-out and of kept subtypes with intervals over motion models."""
    about = json.loads(path.with_suffix(".json").read_text())
    found = predictions.read(path, tuple(about["classes"]))
    clusters = np.char.add(np.char.add(found.subtype, "\n"), found.model.astype(str))
    result = {}
    for name, mask in (("held", np.isin(found.subtype, held)), ("kept", ~np.isin(found.subtype, held))):
        interval = bootstrap(clusters[mask], 100.0 * found.correct[mask], generator_of(1, "fresh-models", name))
        result[name] = (interval.value, interval.low, interval.high)
    return result


def measure(config: dict, folder: Path, table: choose.Choices, out: Path) -> list[list[str]]:
    """Train and judge every candidate; finished ones are read back from `out`. Returns the rows of the table.

    config: the run's configuration; folder: the run's, with views and clouds.
    """
    dataset, stations = opened(folder / "config.yaml"), list(config["network"]["stations"])
    scheme = named(config["recognition"]["table"], table.scheme, stations)
    block = {key: config["recognition"][key] for key in ("size", "network", "training", "augmentation", "evaluation")}
    block["training"] = OPTIONAL | block["training"]
    views = sorted((folder / "views" / str(block["size"])).glob("seen-*.npz"))
    source = ViewSamples([path for path in views if "-test-" not in path.name], scheme.columns, choose.PAIRS)
    parts = {name: part_of(source, rows) for name, rows in choose.parts(source.facts, FOLD, table.folds).items()}
    held = sorted(set(parts["held"].facts.subtype.tolist()))
    shared: dict = {}
    cost, rows = {"samples": 0, "s": 0.0}, []
    for name, changes in table.candidates.items():
        settled = choose.settled(block, changes)
        evaluation, training = settled.pop("evaluation"), settled["training"]
        fresh = Remembered(dataset, scheme.columns, settled["size"], ["seen"], training["stream_models"], held)
        fresh.shared, fresh.cost = shared, cost
        train = Streamed(parts["train"], fresh)
        into = out / slug(name)
        asked = joined_sources(parts["held"], parts["validation"])
        settings = {**settled, "seed": config["seed"], "colour_map": config["images"]["colour_map"]}
        settings["classes"] = list(dataset.classes)
        before = cost["s"]
        if not (into / "predictions.json").is_file():
            shutil.rmtree(into, ignore_errors=True)
            runs.train({"train": train, "validation": parts["validation"]}, scheme, "without fold 0", settings, into)
            trained = runs.load(into / "model.pt", scheme.backbone_of(settings["network"]))
            runs.evaluate(trained, asked, evaluation, into / "predictions.csv")
            about = json.loads((into / "run.json").read_text())
            count = round(training["stream"] * training["batch"]) * training["steps"]
            places = [fresh.place(position) for position in range(count)]
            models = len({(place.subtype, place.model) for place in places})
            about |= {"models": models, "made": len(set(places)), "making_s": cost["s"] - before}
            about["each_s"] = cost["s"] / max(cost["samples"], 1)
            (into / "run.json").write_text(json.dumps(about, indent=1, sort_keys=True) + "\n")
        about, told = json.loads((into / "run.json").read_text()), _told(into / "predictions.csv", held)
        numbers = [about["train_processor_s"] - about["making_s"], about["made"] * about["each_s"]]
        numbers += [*told["held"], *told["kept"]]
        counts = [about["models"], about["steps"], about["parameters"]]
        rows.append([name, *map(str, counts), *(f"{value:.1f}" for value in numbers), describe()])
        print(*rows[-1][:-1], flush=True)
    return rows


def main(arguments: list[str]) -> None:
    """Measure what fresh motion models, steps and a larger network bring. Settings: none ({})."""
    line = parser("lowalt.measure.fresh_models", main.__doc__)
    line.add_argument("--run", required=True, help="folder of a finished run, such as results/default")
    line.add_argument("--candidates", default="config/choices/stream.yaml", help="table of trainings")
    line.add_argument("--work", required=True, help="folder for models and predictions; finished ones are not repeated")
    line.add_argument("--out", required=True, help="table to write (.csv)")
    given = line.parse_args(arguments)
    folder = Path(given.run)
    rows = measure(located(load_yaml(folder / "config.yaml")), folder, choose.read(given.candidates), Path(given.work))
    write_csv(given.out, COLUMNS, rows)


if __name__ == "__main__":
    run(main)
