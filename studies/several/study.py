"""Which classes are in the beam, where there may be several targets: average precision by class and by images seen.

    python studies/several/study.py [--seeds 0 1 2] [--out studies/several/results]

Trains, on the run `several`, networks that answer yes or no for each class (a sigmoid a class, binary cross entropy).
Writes precision.csv: average precision of each class over the test samples, and their mean, with 95 % intervals over
motion models; `beside` is that of the classes which only a companion brings, among samples whose own target is of
another class.
"""

import argparse
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import torch
from sklearn.metrics import average_precision_score
from torch import nn

import trainings
from lowalt.config.command import run
from lowalt.files.csv_tables import write_csv
from lowalt.numerics.streams import stream
from lowalt.recognition import schemes
from lowalt.recognition.augment import augment
from lowalt.recognition.protocols import folds
from lowalt.recognition.recogniser import built
from lowalt.recognition.samples import Facts
from lowalt.scene.effects.channel.companions import listed
from lowalt.shards import ShardSet

DATA = Path("results/several")
HERE = Path(__file__).parent
COLUMNS = ("scheme", "class", "average_precision_percent", "low", "high", "beside_percent", "beside_low",
           "beside_high", "share_percent", "beside_share_percent", "seeds", "samples")  # fmt: skip
STEPS, BATCH, RATE = 600, 32, 2e-3


def present(facts: Facts, config: dict, classes: list[str], class_of: dict[str, str]) -> np.ndarray:
    """Return which classes are in each sample's beam, (samples, classes) bool.

    config: the run's; classes: in the order of their labels; class_of: the class of each subtype.
    """
    settings, seed = config["effects"]["companions"], config["seed"]
    found = np.zeros((len(facts), len(classes)), bool)
    for number, (subtype, model) in enumerate(zip(facts.subtype.tolist(), facts.model.tolist(), strict=True)):
        others = listed(settings, seed, {"subtype": subtype, "model": model})
        found[number, [classes.index(class_of[name]) for name in (subtype, *others)]] = True
    return found


def answered(job: tuple[schemes.Scheme, int], config: dict, classes: list[str], class_of: dict[str, str]) -> np.ndarray:
    """Train one network and return its probabilities (test samples, classes). job: a scheme and a training seed; the
    rest as of `present`."""
    (scheme, seed), block = job, config["recognition"]
    train, test = (trainings.images_of(DATA, scheme, folds("seen", part), block["size"]) for part in ("train", "test"))
    wanted = torch.from_numpy(present(train.facts, config, classes, class_of)).float()
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    model = built(scheme, block["network"], block["size"], config["images"]["colour_map"], len(classes))
    optimiser = torch.optim.AdamW(model.parameters(), RATE, weight_decay=0.05)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, RATE, total_steps=STEPS, pct_start=0.1)
    rng = stream(config["seed"], "several", scheme.name, seed)
    for _ in range(STEPS):
        numbers = rng.integers(len(train.facts), size=BATCH)
        images = augment(train.views(numbers), scheme.columns, block["augmentation"], rng)
        logits = model(torch.from_numpy(images))
        loss = nn.functional.binary_cross_entropy_with_logits(logits, wanted[numbers])
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(model.parameters(), 5.0)
        optimiser.step()
        schedule.step()
    model.eval()
    with torch.inference_mode():
        parts = np.array_split(np.arange(len(test.facts)), -(-len(test.facts) // 256))
        return torch.cat([model(torch.from_numpy(test.views(part))).sigmoid() for part in parts]).numpy()


def precisions(found: np.ndarray, wanted: np.ndarray, label: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return average precision of each class and their mean, over all rows and over those of another label.

    found: probabilities (seeds, samples, classes); wanted: (samples, classes) bool; label: (samples,); rows: numbers of
    the samples to take. The result (2, classes + 1) is the mean over seeds.
    """
    result = np.empty((2, wanted.shape[1] + 1))
    for number in range(wanted.shape[1]):
        beside = rows[label[rows] != number]
        for place, chosen in enumerate((rows, beside)):
            result[place, number] = np.mean(
                [average_precision_score(wanted[chosen, number], one[chosen, number]) for one in found]
            )
    result[:, -1] = result[:, :-1].mean(1)
    return result


def rows_of(name: str, found: np.ndarray, wanted: np.ndarray, facts: Facts, classes: list[str], seed: int) -> list:
    """Return the table's rows of one scheme; arguments as of `precisions`, seed: of the interval's draws."""
    _, motion = np.unique(np.char.add(facts.subtype, facts.model.astype(str)), return_inverse=True)
    members = [np.flatnonzero(motion == model) for model in range(motion.max() + 1)]
    every, rng = np.arange(len(motion)), stream(seed, "several", "interval", name)
    value = precisions(found, wanted, facts.label, every)
    drawn = [np.concatenate([members[model] for model in rng.integers(len(members), size=len(members))])
             for _ in range(200)]  # fmt: skip
    low, high = np.quantile([precisions(found, wanted, facts.label, rows) for rows in drawn], (0.025, 0.975), axis=0)
    beside = [wanted[facts.label != number, number].mean() for number in range(len(classes))]
    shares = [[*wanted.mean(0), wanted.mean()], [*beside, np.mean(beside)]]
    return [
        [name, kind, *(f"{100 * bound[place, number]:.1f}" for place in (0, 1) for bound in (value, low, high)),
         *(f"{100 * share[number]:.1f}" for share in shares), len(found), len(every)]
        for number, kind in enumerate([*classes, "mean"])
    ]  # fmt: skip


def main(arguments: list[str]) -> None:
    """Train all networks and write the table."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    line.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="training seeds (default: 0 1 2)")
    line.add_argument("--out", type=Path, default=HERE / "results", help="folder of the table")
    options = line.parse_args(arguments)
    config = trainings.config_of(HERE / "config.yaml")
    shards = ShardSet(DATA / "shards/index.json", check=False)
    classes = list(shards.classes)
    table = schemes.read(config["recognition"]["table"], "ABC")
    chosen = [table[name] for name in config["recognition"]["schemes"]]
    test = trainings.images_of(DATA, chosen[0], folds("seen", "test"), config["recognition"]["size"]).facts
    class_of = {name: classes[label] for name, label in zip(test.subtype.tolist(), test.label.tolist(), strict=True)}
    wanted = present(test, config, classes, class_of)
    call = partial(answered, config=config, classes=classes, class_of=class_of)
    found = trainings.side_by_side(call, list(product(chosen, options.seeds)))
    rows = []
    for number, scheme in enumerate(chosen):
        seeds = np.stack(found[number * len(options.seeds) :][: len(options.seeds)])
        rows += rows_of(scheme.name, seeds, wanted, test, classes, config["seed"])
    write_csv(options.out / "precision.csv", COLUMNS, rows)


if __name__ == "__main__":
    run(main)
