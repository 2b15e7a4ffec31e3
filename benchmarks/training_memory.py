"""Memory of one training step by its shapes alone: no GPU, no weights and no image are needed.

    python benchmarks/training_memory.py --out results/benchmarks/training_memory.csv

A network of torch's fake tensors, which have shapes and no values, takes one step of
`lowalt.recognition.objective` in bf16. Counted is each storage that is kept for the gradient at the
end of the forward pass of a part, plus weights, gradients, two moments of AdamW and the moving
average in float32. Work space of single operations, such as the scores of attention while they are
computed, comes on top.
"""

import argparse
import itertools

import numpy as np
import torch
from torch._subclasses.fake_tensor import FakeTensorMode

from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition import recogniser
from lowalt.recognition.inference import Machine
from lowalt.recognition.objective import descent
from lowalt.recognition.recipe import check
from lowalt.recognition.schemes import SPECTRA, named
from lowalt.tiles import colour_map

COLUMNS = (
    "backbone",
    "pixels",
    "images_a_step",
    "accumulate",
    "activation_checkpointing",
    "weights_gb",
    "activations_gb",
    "total_gb",
)
STATES = 5
"""Copies of the weights in memory: weights, gradients, two moments of AdamW, moving average."""


KINDS = tuple(
    itertools.product(("workstation", "paper"), ((1, False), (4, False), (1, True), (4, True)))
)


def kept_bytes(config: dict, accumulate: int, again: bool) -> tuple[int, int]:
    """Return the bytes of the weights and those that the forward pass of one part keeps for the
    gradient.
    """
    block = config["recognition"]
    scheme = named(block["table"], "ABC:VRP+TRP+VT", ["A", "B", "C"])
    training = check({**block["training"], "accumulate": accumulate})
    palettes = np.stack([colour_map("viridis")] * len(SPECTRA))
    held: dict[int, int] = {}

    def keep(value: torch.Tensor) -> torch.Tensor:
        """Count a storage once, however many operations keep it."""
        storage = value.untyped_storage()
        held[storage._cdata] = storage.nbytes()
        return value

    model = recogniser.Recogniser(
        scheme, {**block["network"], "weights": "none"}, block["size"], palettes, 4
    ).train()
    if again:
        recogniser.checkpoint_activations(model)
    with FakeTensorMode(allow_non_fake_inputs=True) as fake:
        states = [fake.from_tensor(value) for value in (*model.parameters(), *model.buffers())]
        own = {value.untyped_storage()._cdata for value in states}
        # One part is enough: the parts of a batch follow each other.
        batch = training["batch"] // accumulate
        images = torch.zeros(batch, 9, block["size"], block["size"], dtype=torch.uint8)
        labels = torch.zeros(batch, dtype=torch.long)
        with torch.autograd.graph.saved_tensors_hooks(keep, lambda value: value):
            descent(
                model,
                images,
                labels,
                {**training, "accumulate": 1},
                Machine(torch.device("cpu"), "bf16"),
            )
    weights = sum(value.numel() * 4 for value in model.parameters())
    return weights, sum(size for storage, size in held.items() if storage not in own)


def row(overlay: str, accumulate: int, again: bool) -> list[str]:
    """Return the table's row of a configuration; accumulate: parts of a batch; again: activations
    are computed twice.

    overlay: the configuration's name in `config/`, which is read from the current folder.
    """
    config = load_yaml("config/default.yaml")
    for key, value in load_yaml(f"config/{overlay}.yaml")["recognition"].items():
        config["recognition"][key] = (
            {**config["recognition"][key], **value} if isinstance(value, dict) else value
        )
    block = config["recognition"]
    weights, activations = kept_bytes(config, accumulate, again)
    gigabytes = [STATES * weights / 1e9, activations / 1e9, (STATES * weights + activations) / 1e9]
    facts = [
        block["network"]["backbone"],
        block["size"],
        9 * block["training"]["batch"],
        accumulate,
        again,
    ]
    return [*map(str, facts), *(f"{value:.2f}" for value in gigabytes)]


def main() -> None:
    """Count for the larger configurations and write the table."""
    line = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    line.add_argument("--out", required=True, help="table to write (.csv)")
    given = line.parse_args()
    rows = []
    for overlay, kind in KINDS:
        rows.append(row(overlay, *kind))
        print(*rows[-1], flush=True)
    write_csv(given.out, COLUMNS, rows)


if __name__ == "__main__":
    main()
