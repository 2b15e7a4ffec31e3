"""Made-up samples and predictions for tests of recognition, and its tables read back."""

import csv
import json

import numpy as np

from lowalt.numerics.streams import stream
from lowalt.recognition import predictions, samples, schemes

SUBTYPES = {
    "Mini": ("seen", 0),
    "Avata": ("unseen", 0),
    "Crow": ("seen", 1),
    "Owl": ("unseen", 1),
    "M9": ("seen", 2),
    "A6": ("unseen", 2),
    "Walk": ("seen", 3),
    "Run": ("unseen", 3),
}
SNRS = (3.0, 13.0, np.inf)


def facts(models=10, snrs=SNRS):
    """Facts of the samples of all subtypes, `models` motion models each."""
    rows = [
        (
            f"{name}-{model}-{snr:g}",
            name,
            model,
            snr,
            group,
            ("val", "test", *["train"] * 8)[model % 10],
            label,
        )
        for name, (group, label) in SUBTYPES.items()
        for model in range(models)
        for snr in snrs
    ]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    rng = stream(1, "facts")
    shape = (len(rows), 3)
    return samples.Facts(
        *columns, range_m=rng.uniform(50, 500, shape), aspect_rad=rng.uniform(0, np.pi, shape)
    )


def run_files(folder, protocol, scheme, accuracy, seed=0, models=40):
    """Predictions of a made-up scheme that is right with a known chance, the same luck for equal
    seeds.
    """
    found = facts(models)
    rng = stream(seed, "luck")
    right = rng.random(len(found)) < accuracy
    guess = np.where(right, found.label, (found.label + 1) % 4)
    probabilities = np.full((len(found), 4), 0.1)
    probabilities[np.arange(len(found)), guess] = 0.7
    path = folder / f"{schemes.slug(scheme)}-{protocol}-{seed}.csv"
    predictions.write(path, predictions.from_facts(found, (0, 2), probabilities))
    about = {
        "protocol": protocol,
        "scheme": scheme,
        "seed": seed,
        "hardware": "test bench",
        "train_s": 12.5,
    }
    path.with_suffix(".json").write_text(json.dumps(about))
    return path, found, guess


def read_rows(path):
    """The rows of a CSV file as mappings."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
