"""Finding a learning rate: the loss of a fresh network over rates that rise exponentially from step to step.

`python -m lowalt.recognition.rates` takes the settings and samples of `train`, writes rates.csv and rates.png, and says
at which rate the smoothed loss fell fastest and at which it was least; a training's largest rate lies between them.
Source: L. N. Smith, Cyclical learning rates for training neural networks, WACV 2017, section 3.3; the exponential rise,
the smoothing and the end at four times the least loss as in the library fastai (Howard and Gugger, 2020).
"""

import math
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from torch import nn

from lowalt.common.command import parser, pick, run
from lowalt.common.csv_tables import short, write_csv
from lowalt.common.errors import InputError
from lowalt.common.files import replacing
from lowalt.common.picture_layout import settle
from lowalt.recognition import augment, recipe
from lowalt.recognition.inference import Machine
from lowalt.recognition.methods import built
from lowalt.recognition.objective import descent
from lowalt.recognition.order import batches, epoch_order
from lowalt.recognition.protocols import folds
from lowalt.recognition.samples import ViewSamples
from lowalt.recognition.schemes import PROTOCOLS, TABLE, Scheme, named, refuse_cues
from lowalt.recognition.slow_time import SlowTimeSamples
from lowalt.recognition.sources import of_size
from lowalt.recognition.training import Trainer

COLUMNS = ("step", "rate", "loss", "smoothed")
KEPT = 0.9
"""Share of the smoothed loss that a step keeps."""
DPI = 120
"""Dots per inch of the picture."""
END = 4.0
"""The search ends where the smoothed loss exceeds this many times its least value."""
Samples = ViewSamples | SlowTimeSamples


def rising(low: float, high: float, steps: int) -> np.ndarray:
    """Return learning rates (steps,), each the same multiple of the one before.

    Raises: InputError where they would not rise or are fewer than 10.
    """
    if not 0 < low < high or steps < 10:
        raise InputError(f"rates: from {low} to {high} in {steps} steps, expected 0 < low < high and 10 steps or more")
    return np.geomspace(low, high, steps)


def smooth(losses: Sequence[float]) -> np.ndarray:
    """Return exponentially weighted means of the losses so far (steps,), the weights of each summing to one."""
    found, mean = [], 0.0
    for number, loss in enumerate(losses, start=1):
        mean = KEPT * mean + (1 - KEPT) * loss
        found.append(mean / (1 - KEPT**number))
    return np.array(found)


def _endless(trainer: Trainer, steps: int) -> list[tuple[int, np.ndarray]]:
    """Sample numbers of so many steps, from as many epochs as it takes."""
    found: list[np.ndarray] = []
    epoch = 0
    while len(found) < steps:
        order = epoch_order(trainer.train.facts, trainer.seed, trainer.keys, epoch, trainer.block["snrs_per_model"])
        found += batches(order, trainer.block["batch"])
        epoch += 1
    return list(enumerate(found[:steps]))


def losses(trainer: Trainer, rates: np.ndarray) -> Iterator[float]:
    """Yield the training loss of each step at its rate, until one is not finite or the smoothed loss has risen far.

    The loss of a step is taken before its own update. The trainer's network is changed.
    """
    model, block = trainer.model, trainer.block
    model.train()
    seen: list[float] = []
    batch = iter(trainer.read(_endless(trainer, len(rates))))
    for rate in rates:
        images, labels = (part.to(trainer.machine.device) for part in next(batch))
        for group in trainer.optimiser.param_groups:
            group["lr"] = float(rate) * group["factor"]
        loss = float(descent(trainer.step_model, images, labels, block, trainer.machine))
        seen.append(loss)
        smoothed = smooth(seen)
        if not math.isfinite(loss) or smoothed[-1] > END * smoothed.min():
            return
        yield loss
        if math.isfinite(float(nn.utils.clip_grad_norm_(trainer.weights, block["clip"]))):
            trainer.optimiser.step()
        trainer.optimiser.zero_grad(set_to_none=True)


def marks(rates: np.ndarray, smoothed: np.ndarray) -> tuple[float, float]:
    """Return the rate at which the smoothed loss falls fastest over the logarithm of the rate, and that of its minimum.

    rates, smoothed (steps,); the first tenth of the steps, of whose means few losses are known, is left out.
    Raises: InputError where the loss never fell.
    """
    first, least = len(rates) // 10, int(np.argmin(smoothed)) if len(smoothed) else 0
    if least <= first:
        raise InputError("rates: the loss never fell, expected a lower first rate or more steps")
    slope = np.gradient(smoothed, np.log(rates))[first : least + 1]
    return float(rates[first + int(np.argmin(slope))]), float(rates[least])


def figure(path: Path, rates: np.ndarray, found: np.ndarray, chosen: tuple[float, float]) -> None:
    """Draw the loss and its smoothed course over the rate, with both marks, as PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    picture = Figure(figsize=(6.4, 4), layout="constrained")
    FigureCanvasAgg(picture)
    axes = picture.add_subplot()
    axes.semilogx(rates, found, ".", color="0.7", markersize=4, label="loss of a step")
    axes.semilogx(rates, smooth(found), color="C0", label="smoothed")
    for rate, style, words in zip(chosen, ("--", ":"), ("falls fastest", "least"), strict=True):
        axes.axvline(rate, color="C3", linestyle=style, label=f"{words}: {rate:.2g}")
    axes.set(xlabel="learning rate", ylabel="training loss")
    axes.legend()
    settle(picture, DPI)
    with replacing(path) as temporary:
        picture.savefig(temporary, dpi=DPI, metadata={"Software": None})


def find(
    samples: Samples, scheme: Scheme, protocol: str, settings: dict, out: Path, rates: np.ndarray
) -> tuple[float, float]:
    """Write rates.csv and rates.png into the folder `out` and return `marks`.

    samples: the training fold; settings: as of a training, of whose `training` the rates take the place of rate,
    warmup and steps. Raises: InputError for a wrong setting, a method without rates, or a loss that never falls.
    """
    refuse_cues(scheme, "rates")
    pick(settings, "seed", "size", "colour_map", "network", "training", "augmentation", "classes")
    augment.check(settings["augmentation"])
    block = recipe.check(settings["training"])
    if scheme.sees == "features" or block["stream"]:
        raise InputError("rates: expected a network and training.stream 0")
    keys = ("rates", protocol, scheme.name)
    recipe.seeded(settings["seed"], keys, block["threads"])
    model = built(scheme, settings["network"], settings["size"], settings["colour_map"], len(settings["classes"]))
    parts = {"train": samples, "validation": samples}
    with tempfile.TemporaryDirectory() as nowhere:
        trainer = Trainer(model, parts, scheme.columns, settings, keys, "", nowhere, Machine.here(block["precision"]))
        found = np.array(list(losses(trainer, rates)))
    rates = rates[: len(found)]
    smoothed = smooth(found)
    rows = zip(range(1, len(found) + 1), map(short, rates.tolist()), map(short, found.tolist()),
               map(short, smoothed.tolist()), strict=True)  # fmt: skip
    write_csv(out / "rates.csv", COLUMNS, rows)
    chosen = marks(rates, smoothed)
    figure(out / "rates.png", rates, found, chosen)
    return chosen


def main(arguments: list[str]) -> None:
    """Find a learning rate. Settings: seed, size, colour_map, network, training, augmentation, classes."""
    line = parser("lowalt.recognition.rates", main.__doc__ or "")
    line.add_argument("--views", nargs="+", help="caches of views (.npz)")
    line.add_argument("--signals", nargs="+", help="for schemes on signals: their caches (.npz)")
    line.add_argument("--protocol", required=True, choices=PROTOCOLS)
    line.add_argument("--scheme", required=True, help="name or slug of a row of --schemes")
    line.add_argument("--schemes", default=TABLE, help=f"table of schemes (default: {TABLE})")
    line.add_argument("--stations", nargs="+", required=True, help="names of the network's stations, in its order")
    line.add_argument("--from", dest="low", type=float, default=1e-6, help="first rate (default: 1e-6)")
    line.add_argument("--to", dest="high", type=float, default=1.0, help="last rate (default: 1)")
    line.add_argument("--steps", type=int, default=200, help="steps from one to the other (default: 200)")
    line.add_argument("--out", type=Path, required=True, help="folder for rates.csv and rates.png")
    given = line.parse_args(arguments)
    scheme = named(given.schemes, given.scheme, given.stations)
    pairs, settings = folds(given.protocol, "train"), scheme.settled(given.settings)
    paths = given.views if scheme.sees == "images" else given.signals
    if not paths:
        raise InputError(f"--{'views' if scheme.sees == 'images' else 'signals'}: missing, scheme sees {scheme.sees}")
    samples: Samples = (
        ViewSamples(paths, scheme.columns, pairs) if scheme.sees == "images"
        else SlowTimeSamples(paths, scheme.sees, scheme.columns, pairs)
    )  # fmt: skip
    of_size(samples, scheme, settings["size"])
    rates = rising(given.low, given.high, given.steps)
    fastest, least = find(samples, scheme, given.protocol, settings, given.out, rates)
    print(f"{given.out}: the loss falls fastest at {fastest:.2g} and is least at {least:.2g}")


if __name__ == "__main__":
    run(main)
