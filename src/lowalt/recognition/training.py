"""Training in plain torch: deterministic, exactly resumed, stopped early, refused at a NaN.

An exact resume needs access to the order of samples and to every random state, which training
libraries hide; without a library the loop is still one page. The settings are those of
`lowalt.recognition.recipe`.
"""

import math
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from timm.utils import ModelEmaV3
from torch import nn

from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError, install_command
from lowalt.files.json_objects import json_object
from lowalt.machine.progress import Reporter
from lowalt.recognition import checkpoint, model_file, recogniser
from lowalt.recognition.batches import Augmented, Prefetch, Unchanged, batches, epoch_order
from lowalt.recognition.inference import Machine, probabilities
from lowalt.recognition.matrix_products import as_products
from lowalt.recognition.model_file import ModelFile
from lowalt.recognition.objective import descent
from lowalt.recognition.recipe import averaging, optimiser, random_state, schedule, set_random_state
from lowalt.recognition.samples import Samples
from lowalt.recognition.statistics import cross_entropy

HISTORY = (
    "step",
    "epoch",
    "samples",
    "rate",
    "train_loss",
    "validation_loss",
    "validation_accuracy",
)

Metrics = Callable[[int, dict[str, float]], None]


def tensorboard(folder: str | Path, first: int) -> Metrics:
    """Return a function (step, {name: value}) that appends to TensorBoard's files in `folder`.

    first: the step that the run starts from; entries of an earlier, killed run after it are
    removed.
    Raises: InputError where the package is not installed.
    """
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError as error:
        raise InputError(
            f"recognition.tensorboard: the package tensorboard is not installed ({error}); "
            f"expected `{install_command('tensorboard')}`, or recognition.tensorboard: false"
        ) from error
    writer = SummaryWriter(str(folder), purge_step=first)

    def append(step: int, values: dict[str, float]) -> None:
        """Append the values of one step and write them to disk."""
        for name, value in values.items():
            writer.add_scalar(name, value, step)
        writer.flush()

    return append


class TrainingRun(NamedTuple):
    """Identification of a run.

    keys: names of its random streams; identity: text stored in its checkpoints; folder: where its
    files are written.
    """

    keys: tuple
    identity: str
    folder: Path


@dataclass
class TrainingState:
    """Progress of a run; all of it is stored in the checkpoint."""

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
    """One training run; `finish` writes the best averaged weights and `history.csv`."""

    def __init__(
        self,
        model: nn.Module,
        samples: Mapping[str, Samples],
        columns: list[int],
        settings: dict,
        run: TrainingRun,
        machine: Machine,
    ) -> None:
        """Take the network, the samples and the settings.

        model: a Recogniser; samples: the sources "train" and "validation"; columns: views of the
        scheme.
        settings: {seed, training (as `recipe.check` returns it), augmentation, classes}.
        Raises: InputError for a class without training samples.
        """
        self.block = settings["training"]
        self.seed = settings["seed"]
        self.run = run
        self.machine = machine
        self.train = samples["train"]
        self.validation = samples["validation"]
        classes = settings["classes"]
        missing = sorted(set(range(len(classes))) - set(np.unique(self.train.facts.label).tolist()))
        if missing:
            names = [classes[label] for label in missing]
            raise InputError(f"training: no training sample of {names}, expected some of each")
        if self.block["activation_checkpointing"]:
            recogniser.checkpoint_activations(model)
        layout = torch.channels_last if self.block["channels_last"] else torch.contiguous_format
        shared = machine.with_shared_statistics(model)
        if not machine.gpu and not self.block["compile"] and machine.precision == "fp32":
            shared = as_products(shared)
        self.model = shared.to(machine.device, memory_format=layout)
        self.optimiser = optimiser(self.model, self.block)
        self.average = ModelEmaV3(self.model)
        step_model = self.model
        if self.block["compile"]:
            step_model = torch.compile(self.model)
        self.step_model = machine.parallel(step_model).train()
        # Create the readers once: their workers then live through all epochs and validations.
        keys = (self.seed, *run.keys)
        augmented = Augmented(
            self.train, columns, settings["augmentation"], keys, machine.rank, machine.ranks
        )
        readers = (augmented, Unchanged(self.validation))
        self.read, self.read_validation = (
            Prefetch(read, self.block["workers"], pin=machine.gpu) for read in readers
        )
        self.best_weights: dict = {}
        self.waited_s = 0.0
        self.metrics: Metrics | None = None
        self.at = TrainingState()

    def save(self) -> None:
        """Write the checkpoint; refuses to write weights that are not finite."""
        self._refuse_unfinite_loss()
        self._refuse_unfinite_weights()
        if self.machine.rank == 0:
            checkpoint.save(self.run.folder / "checkpoint.pt", self.run.identity, self._state())

    def _state(self) -> dict:
        """Return everything that a resumed training needs."""
        return {
            "model": self.model.state_dict(),
            "ema": self.average.module.state_dict(),
            "best": self.best_weights,
            "optimiser": self.optimiser.state_dict(),
            "at": vars(self.at),
            "random": random_state(self.machine.device),
        }

    def resume(self) -> bool:
        """Continue from the checkpoint of this run; return whether there was one."""
        path = self.run.folder / "checkpoint.pt"
        if not path.exists():
            return False
        _, state = checkpoint.load(path, self.run.identity)
        self.model.load_state_dict(state["model"])
        self.average.module.load_state_dict(state["ema"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.best_weights = state["best"]
        self.at = TrainingState(**state["at"])
        set_random_state(self.machine.device, state["random"])
        return True

    def _refuse_unfinite_loss(self) -> None:
        """Raise InputError where the loss is not finite."""
        if not math.isfinite(self.at.loss_sum):
            where = f"in epoch {self.at.epoch} at step {self.at.steps}"
            raise InputError(f"training: loss is {self.at.loss_sum} {where}; {self._advice}")

    def _refuse_unfinite_weights(self) -> None:
        """Raise InputError naming the weights that are not finite."""
        # A weight can overflow although loss and gradient are finite; the next loss would reveal it
        # after a checkpoint.
        for name, value in self.model.state_dict().items():
            if value.is_floating_point() and not bool(value.isfinite().all()):
                raise InputError(
                    f"training: weights {name} are not finite after step {self.at.steps}; "
                    f"{self._advice}"
                )

    @property
    def _advice(self) -> str:
        """Advice for the error message when numbers are not finite."""
        return (
            "the last checkpoint is from before. Try a lower training.rate than "
            f"{self.block['rate']}"
        )

    def _rate(self, step: int) -> float:
        """Learning rate of a step (1, 2, ...), before a group's factor."""
        return self.block["rate"] * schedule(step / self.block["steps"], self.block["warmup"])

    def _step(self, images: torch.Tensor, labels: torch.Tensor) -> None:
        """Take one optimiser step on a batch and update the moving average of the weights."""
        images, labels = (
            part.to(self.machine.device, non_blocking=True) for part in (images, labels)
        )
        for group in self.optimiser.param_groups:
            group["lr"] = self._rate(self.at.steps + 1) * group["factor"]
        loss = descent(self.step_model, images, labels, self.block, self.machine)
        norm = nn.utils.clip_grad_norm_(self.model.parameters(), self.block["clip"], foreach=True)
        self.at.loss_sum += float(loss)
        self.at.loss_steps += 1
        self._refuse_unfinite_loss()
        if math.isfinite(float(norm)):
            self.optimiser.step()
            self.at.skipped = 0
        else:
            # A gradient can overflow although the loss is finite. Skip such a step; ten in a row
            # end the training.
            self.at.skipped += 1
            print(
                f"training: gradient is {float(norm)} at step {self.at.steps}, step skipped",
                file=sys.stderr,
            )
            if self.at.skipped >= 10:
                raise InputError(
                    "training: ten gradients in a row were not finite, last at step "
                    f"{self.at.steps}"
                )
        self.optimiser.zero_grad()
        self.at.steps += 1
        self.average.decay = averaging(self.block["ema"], self.at.steps)
        self.average.update(self.model)

    def _validate(self) -> None:
        """Validate the averaged weights, keep the best, and decide whether to stop early."""
        self._refuse_unfinite_weights()
        facts = self.validation.facts
        loss = self.at.loss_sum / self.at.loss_steps
        answers = probabilities(
            self.average.module,
            self.validation,
            np.arange(len(facts)),
            self.machine,
            self.block["batch"],
            ahead=self.read_validation,
        )
        accuracy = float(np.mean(answers.argmax(1) == facts.label))
        row = (
            self.at.steps,
            self.at.epoch,
            self.at.steps * self.block["batch"],
            self._rate(self.at.steps),
            loss,
            float(cross_entropy(answers, facts.label)),
            accuracy,
        )
        self.at.history.append(row)
        self.at.since_best += 1
        if accuracy > self.at.best:
            self.at.since_best = 0
        if accuracy >= self.at.best:
            self.at.best = accuracy
            weights = self.average.module.state_dict()
            self.best_weights = {
                key: value.detach().cpu().clone() for key, value in weights.items()
            }
        self.at.loss_sum = 0.0
        self.at.loss_steps = 0
        self.at.done = bool(self.block["patience"]) and self.at.since_best >= self.block["patience"]

    def fit(self) -> None:
        """Train from the current state to the last step, or until validation stops improving."""
        start = time.monotonic()
        saved = time.monotonic()
        first = self.at.steps
        steps = self.block["steps"]
        report = Reporter(steps, "steps")
        while self.at.steps < steps and not self.at.done:
            order = epoch_order(
                self.train.facts,
                self.seed,
                self.run.keys,
                self.at.epoch,
                self.block["snrs_per_model"],
            )
            of_epoch = batches(order, self.block["batch"])
            remaining = of_epoch[self.at.batch :][: steps - self.at.steps]
            # Number the batches by step: the step alone determines the augmentation.
            numbered = list(enumerate(remaining, start=self.at.steps))
            read = self.read(numbered)
            for _ in numbered:
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
                if time.monotonic() - saved > self.block["checkpoint_s"]:
                    self.save()
                    saved = time.monotonic()
                if self.at.done:
                    break
            if self.at.batch == len(of_epoch):
                self.at.epoch += 1
                self.at.batch = 0

    def _say(self, start: float, first: int) -> None:
        """Print the last validation and the speed.

        start: when this process began (s); first: its first step.
        """
        if self.machine.rank:
            return
        spent = time.monotonic() - start
        speed = (self.at.steps - first) / spent
        left = (self.block["steps"] - self.at.steps) / speed
        row = dict(zip(HISTORY, self.at.history[-1], strict=True))
        pace = {
            "samples_per_s": speed * self.block["batch"],
            "waiting_share": self.waited_s / spent,
        }
        if self.metrics:
            self.metrics(row["step"], {name: row[name] for name in HISTORY[3:]} | pace)
        print(
            f"step {row['step']}/{self.block['steps']} loss {row['train_loss']:.4f} validation "
            f"{100 * row['validation_accuracy']:.2f} % (loss {row['validation_loss']:.4f}) "
            f"{pace['samples_per_s']:.0f} samples/s, {100 * pace['waiting_share']:.1f} % of the "
            f"time waiting for data, {left:.0f} s left",
            file=sys.stderr,
            flush=True,
        )

    def finish(self, extra: dict) -> None:
        """Write `model.safetensors` and `history.csv`, and delete the checkpoint.

        The model has the best averaged weights and `extra`.
        """
        if self.machine.rank:
            return
        folder = self.run.folder
        weights = {name: value.contiguous() for name, value in self.best_weights.items()}
        content = ModelFile(
            weights, json_object(self.run.identity, folder, "a training"), extra, {}, {}
        )
        model_file.write(folder / "model.safetensors", content)
        rows = [list(map(repr, row)) for row in self.at.history]
        write_csv(folder / "history.csv", HISTORY, rows)
        (folder / "checkpoint.pt").unlink(missing_ok=True)
