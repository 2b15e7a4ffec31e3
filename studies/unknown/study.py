"""Networks that were not shown a class, and what tells its windows, noise, land and other kinds from the known ones.

    python studies/unknown/study.py [--data default] [--seeds 0 1 2] [--out studies/unknown/results]

Trains on the views of a finished run's data set, into results/unknown. Writes, into OUT:
    held.csv     one row per unknown and score: AUROC, and the share of the unknown kept where 95 % of the known are
    curve.csv    share of the unknown kept by share of the known kept, of networks that know all four classes
    curve.png    the same
"""

import argparse
import copy
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import NamedTuple

import foreign
import numpy as np
import rejection
import torch

import trainings
from lowalt.config.command import run
from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import write_csv
from lowalt.numerics.streams import stream
from lowalt.recognition import runs
from lowalt.recognition.inference import Machine
from lowalt.recognition.protocols import folds
from lowalt.recognition.samples import Samples, ViewSamples, joined_sources
from lowalt.recognition.schemes import Scheme

SCHEME = Scheme("ABC:VRP+TRP+VT", (0, 1, 2), (0, 1, 2))
OTHER = "Other"
"""Name of the extra class."""
SHOWN = ("Cessna 172S", "MD 520N", "Road cyclist", "Weather balloon")
"""Targets of other kinds that the extra class is trained on; the remaining ones of others.yaml are asked about."""
SCORES = {
    "largest probability": (False, rejection.probability), "energy": (False, rejection.energy),
    "extra class": (True, rejection.no_extra), "extra class, largest probability": (True, rejection.probability),
}  # fmt: skip
"""Whether a score is of networks with an extra class, and its function."""
GRID = (0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.925, 0.95, 0.975, 0.99, 0.995)
COLUMNS = (
    "unknown", "score", "auroc_percent", "auroc_low", "auroc_high", "fpr95_percent", "fpr95_low", "fpr95_high",
    "accuracy_percent", "seeds", "known_windows", "unknown_windows",
)  # fmt: skip


class Job(NamedTuple):
    """One training: the class held out ("" for none), whether there is an extra class, and the training seed."""

    held: str
    extra: bool
    seed: int

    @property
    def name(self) -> str:
        """Folder of its files."""
        return f"{self.held or 'all'}/{'extra' if self.extra else 'plain'}/{self.seed}"


def part_of(samples: ViewSamples, rows: np.ndarray, labels: np.ndarray | None = None) -> ViewSamples:
    """Return the samples of some rows (a mask), with labels (rows,) of their own where they are given."""
    found = copy.copy(samples)
    found.keep(np.flatnonzero(rows))
    if labels is not None:
        found.facts = replace(found.facts, label=labels)
    return found


def logits(model: torch.nn.Module, samples: Samples, batch: int = 256) -> np.ndarray:
    """Return the logits (n, classes) float64 of all samples of a source."""
    model = Machine.here("fp32").placed(model).eval()
    with torch.inference_mode():
        parts = [model(torch.from_numpy(samples.views(np.arange(start, min(start + batch, len(samples.facts))))))
                 for start in range(0, len(samples.facts), batch)]  # fmt: skip
    return torch.cat(parts).double().numpy()


def asked_of(data: Path, out: Path, size: int) -> ViewSamples:
    """Return all windows that every network is asked about: the test fold of the four classes, other kinds, noise and
    land; what is none of the four has the label -1."""
    known = trainings.images_of(data, SCHEME, folds("seen", "test"), size)
    for name in ("others", "noise", "land"):
        pairs = {pair for pair in foreign.EVERY if name == "others" or pair[1] == "test"}
        more = ViewSamples([foreign.cached(name, SCHEME, size, out / "foreign")], SCHEME.columns, pairs)
        rows = ~np.isin(more.facts.subtype, SHOWN)
        known = joined_sources(known, part_of(more, rows, np.full(int(rows.sum()), -1)))
    return known


def training_part(job: Job, classes: list[str], data: Path, out: Path, size: int, part: str) -> ViewSamples:
    """Return the samples of a part, "train" or "validation": without the class held out, with the extra class."""
    whole = trainings.images_of(data, SCHEME, folds("seen", part), size)
    names = np.array(classes)[whole.facts.label]
    kept = [name for name in classes if name != job.held]
    rows = names != job.held
    labels = np.array([kept.index(name) for name in names[rows]])
    found = part_of(whole, rows, labels)
    for name in ("others", "noise") if job.extra else ():
        more = ViewSamples([foreign.cached(name, SCHEME, size, out / "foreign")], SCHEME.columns, folds("seen", part))
        rows = np.isin(more.facts.subtype, (*SHOWN, "noise"))
        found = joined_sources(found, part_of(more, rows, np.full(int(rows.sum()), len(kept))))
    return found


def answered(job: Job, config: dict, data: Path, out: Path) -> Path:
    """Train a network, unless that is done, and return the file of its logits of all asked windows."""
    path = out / job.name / "logits.npy"
    if path.is_file():
        return path
    size = config["recognition"]["size"]
    settings = trainings.settings_of(config, data, SCHEME, job.seed)
    classes = list(settings["classes"])
    parts = {part: training_part(job, classes, data, out, size, part) for part in trainings.PARTS}
    kept = [name for name in classes if name != job.held]
    settings["classes"] = [*kept, *([OTHER] if job.extra else [])]
    runs.train(parts, SCHEME, f"without {job.held or 'nothing'}", settings, path.parent)
    found = logits(runs.load(path.with_name("model.pt")).model, asked_of(data, out, size))
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.save(file, found)
    return path


class Case(NamedTuple):
    """An unknown as the networks of all seeds see it: logits (seeds, n, classes), which windows are known (n,), their
    labels among the known classes (n,), motion models and subtypes (n,), and the number of known classes."""

    logits: np.ndarray
    known: np.ndarray
    label: np.ndarray
    motion: np.ndarray
    subtype: np.ndarray
    classes: int


def case_of(unknown: str, found: np.ndarray, asked: ViewSamples, classes: tuple[str, ...]) -> Case:
    """Return the case of an unknown: one of the classes, or "noise", "land" or "other kinds".

    found: logits (seeds, windows, classes) of all asked windows by the networks that do not know it.
    """
    facts = asked.facts
    held = classes.index(unknown) if unknown in classes else None
    empty = np.isin(facts.subtype, ("noise", "land"))
    theirs = {
        "noise": facts.subtype == "noise", "land": facts.subtype == "land", "other kinds": (facts.label < 0) & ~empty,
    }.get(unknown, facts.label == held)  # fmt: skip
    known = (facts.label >= 0) & (facts.label != held)
    rows = known | theirs
    label = facts.label - (facts.label > held) if held is not None else facts.label
    motion = np.char.add(np.char.add(facts.subtype, "\n"), facts.model.astype(str))
    count = len(classes) - (held is not None)
    return Case(found[:, rows], known[rows], label[rows], motion[rows], facts.subtype[rows], count)


def rows_of(name: str, unknowns: list[str], cases: dict, seed: int) -> list[list]:
    """Return the table's rows of one score: one per unknown, and the mean over the classes that were held out."""
    extra, score = SCORES[name]
    rows, kept = [], []
    for unknown in unknowns:
        case = cases[unknown, extra]
        scores = np.array([score(one, case.classes) for one in case.logits])
        told = rejection.measured(
            scores, case.known, case.motion, case.subtype, stream(seed, "unknown", "interval", unknown)
        )
        guesses = case.logits[:, case.known, : case.classes].argmax(2)
        accuracy = float(np.mean(guesses == case.label[case.known]))
        counts = [len(scores), int(case.known.sum()), int((~case.known).sum())]
        rows.append([unknown, *told, accuracy, *counts])
        if unknown not in ("noise", "land", "other kinds"):
            kept.append(rows[-1])
    mean = ["mean of the four classes", *(np.mean([row[place] for row in kept], axis=0) for place in (1, 2, 3))]
    rows.append([*mean, kept[0][4], "", ""])
    table = []
    for unknown, value, repeats, accuracy, *counts in rows:
        cells = [rejection.interval(value[place], repeats[:, place]) for place in (0, 1)]
        numbers = [f"{100 * number:.1f}" for cell in cells for number in cell]
        table.append([unknown, name, *numbers, f"{100 * accuracy:.1f}", *counts])
    return table


def curves(cases: dict, unknowns: tuple[str, ...]) -> list[list]:
    """Return rows (unknown, score, share of the known kept, share of the unknown kept), means over seeds, percent."""
    rows = []
    for unknown, (name, (extra, score)) in product(unknowns, SCORES.items()):
        case = cases[unknown, extra]
        scores = [score(one, case.classes) for one in case.logits]
        for kept in GRID:
            every = np.ones(int(case.known.sum())), np.ones(int((~case.known).sum()))
            found = [rejection.alarms(one[case.known], one[~case.known], *every, kept) for one in scores]
            rows.append([unknown, name, f"{100 * kept:.1f}", f"{100 * np.mean(found):.2f}"])
    return rows


def drawn(rows: list[list], path: Path) -> None:
    """Write the picture of the rows of `curves`: one panel per unknown, one line per score."""
    from matplotlib.figure import Figure

    unknowns = list(dict.fromkeys(row[0] for row in rows))
    figure = Figure(figsize=(4 * len(unknowns), 3.6), layout="constrained")
    panels = figure.subplots(1, len(unknowns), sharey=True)
    for panel, unknown in zip(panels, unknowns, strict=True):
        for name, mark in zip(SCORES, "osv^", strict=True):
            points = np.array([row[2:] for row in rows if row[:2] == [unknown, name]], float)
            panel.plot(np.maximum(points[:, 1], 0.1), points[:, 0], marker=mark, markersize=4, label=name)
        panel.set(title=unknown, xscale="log", xlim=(0.09, 110), xlabel="of these called known, %")
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("of the known called known, %")
    panels[-1].legend(fontsize=8)
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")


def main(arguments: list[str]) -> None:
    """Train all networks and write the tables and the picture."""
    line = argparse.ArgumentParser("study.py", description=__doc__.splitlines()[0])
    line.add_argument("--data", default="default", help="finished run whose data set is trained on (default: default)")
    line.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="training seeds (default: 0 1 2)")
    line.add_argument("--workers", type=int, help="trainings side by side (default: the cores)")
    line.add_argument("--out", type=Path, default=Path(__file__).parent / "results", help="folder of the tables")
    given = line.parse_args(arguments)
    config = trainings.config_of(foreign.HERE / "config.yaml")
    data, out = Path("results") / given.data, Path("results/unknown")
    size = config["recognition"]["size"]
    for name in foreign.MAKERS:
        foreign.cached(name, SCHEME, size, out / "foreign")
    classes = tuple(trainings.settings_of(config, data, SCHEME, 0)["classes"])
    jobs = [Job(held, extra, seed) for seed, held, extra in product(given.seeds, ("", *classes), (False, True))]
    call = partial(answered, config=config, data=data, out=out)
    paths = dict(zip(jobs, trainings.side_by_side(call, jobs, given.workers), strict=True))
    asked, cases = asked_of(data, out, size), {}
    unknowns = [*classes, "other kinds", "noise", "land"]
    for unknown, extra in product(unknowns, (False, True)):
        held = unknown if unknown in classes else ""
        found = np.stack([np.load(paths[Job(held, extra, seed)]) for seed in given.seeds])
        cases[unknown, extra] = case_of(unknown, found, asked, classes)
    table = [row for name in SCORES for row in rows_of(name, unknowns, cases, config["seed"])]
    write_csv(given.out / "held.csv", COLUMNS, table)
    rows = curves(cases, ("noise", "land", "other kinds"))
    write_csv(given.out / "curve.csv", ("unknown", "score", "known_kept_percent", "unknown_kept_percent"), rows)
    drawn(rows, given.out / "curve.png")


if __name__ == "__main__":
    run(main)
