"""From settings to the files of a classical training, which are those of a network's, so the same rules read them."""

import time
from pathlib import Path

from lowalt.common.csv_tables import write_csv
from lowalt.common.hardware import describe
from lowalt.recognition import checkpoint, classical, recipe
from lowalt.recognition.schemes import Scheme


def train(samples: dict, scheme: Scheme, protocol: str, settings: dict, folder: Path) -> dict:
    """Train a classical method and write `model.pt` and `history.csv` into `folder`; return the run's record.

    samples: the sources "train" and "validation", of features; settings: as of a network's training, of which seed,
    training.threads and classes are used.
    Raises: InputError as `classical.fit`.
    """
    classes, seed, threads = settings["classes"], settings["seed"], settings["training"]["threads"]
    recipe.seeded(seed, (protocol, scheme.name), threads)
    start, busy = time.monotonic(), time.process_time()
    model, history = classical.fit(samples, scheme.method, len(classes), seed, (protocol, scheme.name))
    seconds, busy = time.monotonic() - start, time.process_time() - busy
    name = checkpoint.identity(
        scheme=scheme.record, protocol=protocol, seed=seed,
        samples={part: source.sha256() for part, source in samples.items()},
    )  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    checkpoint.save(folder / "model.pt", name, {
        "weights": model.state_dict(), "scheme": scheme.record, "protocol": protocol, "size": settings["size"],
        "seed": seed, "network": {}, "colour_map": "", "classes": list(classes),
    })  # fmt: skip
    write_csv(folder / "history.csv", classical.HISTORY, [[*map(str, row)] for row in history])
    rounds = min(history, key=lambda row: row[2])[1]
    return {
        "protocol": protocol, "scheme": scheme.name, "seed": seed, "hardware": describe(), "backbone": scheme.method,
        "weights": "none", "parameters": sum(value.numel() for value in model.state_dict().values()),
        "train_samples": len(samples["train"].facts), "validation_accuracy": min(history, key=lambda row: row[2])[3],
        "train_s": seconds, "train_processor_s": busy, "steps": rounds, "precision": "fp64", "ranks": 1,
        "size": settings["size"], "classes": list(classes),
    }  # fmt: skip
