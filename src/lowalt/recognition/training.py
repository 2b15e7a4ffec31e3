"""Training in plain torch: deterministic order, exact resume, early stopping on validation, an error at the first NaN.

An exact resume needs the order of samples and every random state. A library of training loops would hide them, and the
loop is one page without it. The settings are those of `lowalt.recognition.recipe`.
"""

import math
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import nn

from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.machine.progress import Reporter
from lowalt.recognition import checkpoint, network
from lowalt.recognition.ahead import ReadAhead, Unchanged
from lowalt.recognition.batch_norm import over_ranks
from lowalt.recognition.inference import Machine, probabilities
from lowalt.recognition.matrix_products import as_products
from lowalt.recognition.metrics import Metrics
from lowalt.recognition.moving_average import MovingAverage
from lowalt.recognition.objective import descent
from lowalt.recognition.order import batches, epoch_order
from lowalt.recognition.reader import Reader
from lowalt.recognition.recipe import averaging, check, optimiser, random_state, schedule, set_random_state
from lowalt.recognition.statistics import cross_entropy

HISTORY = ("step", "epoch", "samples", "rate", "train_loss", "validation_loss", "validation_accuracy")


@dataclass
class TrainingState:
    """Where a run stands; everything in it goes into the checkpoint."""

    epoch: int = 0
    batch: int = 0
    steps: int = 0
    loss_sum: float = 0.0
    loss_steps: int = 0
    skipped: int = 0
    best: float = -1.0
    since_best: int = 0
    history: list = field(default_factory=list)
    done: bool = False


class Trainer:
    """One training run: `fit` ends with the best averaged weights in `model.pt` and the history in `history.csv`."""

    def __init__(self, model, samples, columns, settings, keys, name, folder, machine: Machine) -> None:
        """model: a Recogniser; samples: {"train": ..., "validation": ...} sources; columns: views of the scheme.

        settings: {"seed", "training", "augmentation", "classes"}; keys: what names the run's random streams; name: the
        run's identity, which its checkpoints carry; folder: where its files go.
        """
        self.block = check(settings["training"])
        self.augmentation, self.seed = settings["augmentation"], settings["seed"]
        self.train, self.validation = samples["train"], samples["validation"]
        self.columns, self.keys, self.name, self.folder, self.machine = columns, keys, name, Path(folder), machine
        classes = settings["classes"]
        missing = sorted(set(range(len(classes))) - set(np.unique(self.train.facts.label).tolist()))
        if missing:
            raise InputError(
                f"training: no training sample of {[classes[one] for one in missing]}, expected some of each"
            )
        if self.block["activation_checkpointing"]:
            network.checkpoint_activations(model)
        layout = torch.channels_last if self.block["channels_last"] else torch.contiguous_format
        shared = over_ranks(model) if machine.ranks > 1 else model
        cpu = not machine.gpu and not self.block["compile"]
        shared = as_products(shared) if cpu and machine.precision == "fp32" else shared
        self.model = shared.to(machine.device, memory_format=layout)
        self.optimiser = optimiser(self.model, self.block, flat=cpu and machine.ranks == 1)
        self.weights = [value for group in self.optimiser.param_groups for value in group["params"]]
        self.ema = MovingAverage(self.model, self.block["ema"])
        self.step_model = machine.parallel(torch.compile(self.model) if self.block["compile"] else self.model).train()
        # Readers keep their workers over all epochs and validations.
        reader = Reader(self.train, columns, self.augmentation, (self.seed, *keys), machine)
        readers = (reader, Unchanged(self.validation))
        self.read, self.read_validation = (ReadAhead(read, self.block["workers"], pin=machine.gpu) for read in readers)
        self.best_weights: dict = {}
        self.waited_s = 0.0
        self.metrics: Metrics | None = None
        self.at = TrainingState()

    def _order(self, epoch: int) -> np.ndarray:
        """Return the sample numbers of an epoch in training order."""
        return epoch_order(self.train.facts, self.seed, self.keys, epoch, self.block["snrs_per_model"])

    def _numbered(self, parts: list[np.ndarray]) -> list[tuple[int, np.ndarray]]:
        """Return the sample numbers of the next batches, each with its step, which alone decides what a batch holds."""
        return list(enumerate(parts, start=self.at.steps))

    def save(self) -> None:
        """Write the checkpoint; refuses to write weights that are not finite."""
        self._finite()
        self._finite_weights()
        if self.machine.rank == 0:
            checkpoint.save(self.folder / "checkpoint.pt", self.name, self._state())

    def _state(self) -> dict:
        """Return everything that a resumed training needs."""
        return {
            "model": self.model.state_dict(), "ema": self.ema.module.state_dict(), "best": self.best_weights,
            "optimiser": self.optimiser.state_dict(), "at": vars(self.at),
            "random": random_state(self.machine.device),
        }  # fmt: skip

    def resume(self) -> bool:
        """Continue from the checkpoint of this run, if there is one; return whether there was one."""
        path = self.folder / "checkpoint.pt"
        if not path.exists():
            return False
        _, state = checkpoint.load(path, self.name)
        self.model.load_state_dict(state["model"])
        self.ema.module.load_state_dict(state["ema"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.best_weights = state["best"]
        self.at = TrainingState(**state["at"])
        set_random_state(self.machine.device, state["random"])
        return True

    def _finite(self) -> None:
        """Refuse a loss that is not finite."""
        if not math.isfinite(self.at.loss_sum):
            raise InputError(
                f"training: loss is {self.at.loss_sum} in epoch {self.at.epoch} at step {self.at.steps}; "
                f"no checkpoint was written since. Try a lower training.rate than {self.block['rate']}"
            )

    def _finite_weights(self) -> None:
        """Raise InputError naming the weights that are not finite."""
        # A step of finite loss and gradient can overflow a weight; the next loss would show it only after a checkpoint.
        for name, value in self.model.state_dict().items():
            if value.is_floating_point() and not bool(value.isfinite().all()):
                raise InputError(
                    f"training: weights {name} are not finite after step {self.at.steps}; no checkpoint was written "
                    f"since. Try a lower training.rate than {self.block['rate']}"
                )

    def _step(self, images: torch.Tensor, labels: torch.Tensor) -> None:
        """Take one optimiser step on a batch and update the moving average of the weights."""
        images, labels = (part.to(self.machine.device, non_blocking=True) for part in (images, labels))
        rate = self.block["rate"] * schedule((self.at.steps + 1) / self.block["steps"], self.block["warmup"])
        for group in self.optimiser.param_groups:
            group["lr"] = rate * group["factor"]
        loss = descent(self.step_model, images, labels, self.block, self.machine)
        norm = nn.utils.clip_grad_norm_(self.weights, self.block["clip"], foreach=True)
        self.at.loss_sum += float(loss)
        self.at.loss_steps += 1
        self._finite()
        if math.isfinite(float(norm)):
            self.optimiser.step()
            self.at.skipped = 0
        else:
            # A gradient can overflow where the loss does not. Such a step is left out; ten in a row end the training.
            self.at.skipped += 1
            print(f"training: gradient is {float(norm)} at step {self.at.steps}, step left out", file=sys.stderr)
            if self.at.skipped >= 10:
                raise InputError(f"training: ten gradients in a row were not finite, last at step {self.at.steps}")
        self.optimiser.zero_grad(set_to_none=True)
        self.at.steps += 1
        if self.block["ema"]:
            self.ema.decay = averaging(self.block["ema"], self.at.steps)
            self.ema.update(self.model)
        else:
            self.ema.set(self.model)

    def _validate(self) -> None:
        """Validate the averaged weights, keep the best, and decide whether to stop early."""
        self._finite_weights()
        facts, batch, ahead = self.validation.facts, self.block["batch"], self.read_validation
        numbers, loss = np.arange(len(facts)), self.at.loss_sum / self.at.loss_steps
        found = probabilities(self.ema.module, self.validation, numbers, self.machine, batch, False, ahead)
        accuracy = float(np.mean(found.argmax(1) == facts.label))
        rate = self.block["rate"] * schedule(self.at.steps / self.block["steps"], self.block["warmup"])
        row = (self.at.steps, self.at.epoch, self.at.steps * self.block["batch"], rate,
               loss, float(cross_entropy(found, facts.label)), accuracy)  # fmt: skip
        self.at.history.append(row)
        if accuracy >= self.at.best:
            self.at.since_best = 0 if accuracy > self.at.best else self.at.since_best + 1
            self.at.best = accuracy
            weights = self.ema.module.state_dict()
            self.best_weights = {key: value.detach().cpu().clone() for key, value in weights.items()}
        else:
            self.at.since_best += 1
        self.at.loss_sum, self.at.loss_steps = 0.0, 0
        self.at.done = bool(self.block["patience"]) and self.at.since_best >= self.block["patience"]

    def fit(self) -> TrainingState:
        """Train to the last step or until validation stops improving; goes on from where the run stands."""
        start, last, first = time.monotonic(), time.monotonic(), self.at.steps
        report = Reporter(steps := self.block["steps"], "steps")
        while self.at.steps < steps and not self.at.done:
            parts = batches(self._order(self.at.epoch), self.block["batch"])
            rest = parts[self.at.batch : self.at.batch + steps - self.at.steps]
            read = self.read(self._numbered(rest))
            while self.at.batch < len(parts) and self.at.steps < steps and not self.at.done:
                asked = time.monotonic()
                batch = next(read)
                self.waited_s += time.monotonic() - asked
                self._step(*batch)
                self.at.batch += 1
                if not self.machine.rank:
                    report(self.at.steps)
                if self.at.steps % self.block["validate_every"] == 0 or self.at.steps == steps:
                    self._validate()
                    self._say(start, first)
                if time.monotonic() - last > self.block["checkpoint_s"]:
                    self.save()
                    last = time.monotonic()
            if self.at.batch == len(parts):
                self.at.epoch, self.at.batch = self.at.epoch + 1, 0
        return self.at

    def _say(self, start: float, first: int) -> None:
        """Print the last validation and the pace; start: when the run began (s), first: the step it began at."""
        if self.machine.rank:
            return
        spent = time.monotonic() - start
        speed = (self.at.steps - first) / spent
        left = (self.block["steps"] - self.at.steps) / speed
        row = dict(zip(HISTORY, self.at.history[-1], strict=True))
        pace = {"samples_per_s": speed * self.block["batch"], "waiting_share": self.waited_s / spent}
        if self.metrics:
            self.metrics(row["step"], {name: row[name] for name in HISTORY[3:]} | pace)
        print(
            f"step {row['step']}/{self.block['steps']} loss {row['train_loss']:.4f} "
            f"validation {100 * row['validation_accuracy']:.2f} % (loss {row['validation_loss']:.4f}) "
            f"{pace['samples_per_s']:.0f} samples/s, {100 * pace['waiting_share']:.1f} % of the time waiting for data, "
            f"{left:.0f} s left",
            file=sys.stderr, flush=True,
        )  # fmt: skip

    def finish(self, extra: dict) -> None:
        """Write `model.pt` (best averaged weights, `extra`) and `history.csv`, and drop the checkpoint."""
        if self.machine.rank:
            return
        checkpoint.save(self.folder / "model.pt", self.name, {"weights": self.best_weights, **extra})
        write_csv(self.folder / "history.csv", HISTORY, [[repr(value) for value in row] for row in self.at.history])
        (self.folder / "checkpoint.pt").unlink(missing_ok=True)
