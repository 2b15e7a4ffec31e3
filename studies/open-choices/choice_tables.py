"""Judging answers to held-out subtypes, and the tables of rows."""

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from lowalt.files.csv_tables import write_csv
from lowalt.numerics.streams import stream
from lowalt.recognition import predictions
from lowalt.recognition.intervals import Interval, model_shares, strict_difference
from lowalt.recognition.protocols import folds
from lowalt.recognition.samples import Facts


class Held:
    """Answers to samples of held-out subtypes, one row per training seed and one column per motion
    model.
    """

    def __init__(self, facts: Facts | predictions.Predictions, correct: list[np.ndarray]) -> None:
        """facts: of the samples; correct: (samples,) bool, of each training seed."""
        first, self.count, self.shares = model_shares(facts.motion, correct)
        self.subtype = facts.subtype[first]

    def difference(
        self, other: "Held | None", name: str, seed: int, *keys: str, whole: bool = True
    ) -> Interval:
        """Return the share of right answers less that of others to the same samples, None for
        nothing, with its 95 % interval over training seeds, motion models and, where no subtype is
        named and `whole`, subtypes."""
        mine = np.full(len(self.subtype), True) if not name else self.subtype == name
        second = np.zeros((1, mine.sum())) if other is None else other.shares[:, mine]
        facts = self.count[mine], self.subtype[mine], whole and not name
        return strict_difference(
            self.shares[:, mine], second, *facts, stream(seed, "open-choices", *keys, name)
        )

    def worst(self, count: int = 3) -> str:
        """Return the subtypes that are right least often, with their percentages."""
        shares = {name: self.share(name) for name in np.unique(self.subtype)}
        return "; ".join(
            f"{name} {100 * shares[name]:.0f}"
            for name in sorted(shares, key=shares.__getitem__)[:count]
        )

    def share(self, name: str) -> float:
        """Return the share of a subtype's samples that are right."""
        mine = self.subtype == name
        return float(np.average(self.shares[:, mine].mean(0), weights=self.count[mine]))


def percents(values: Iterable[float]) -> list[str]:
    """Return shares as percentages."""
    return [f"{100 * value:.1f}" for value in values]


NAMED = {
    "unseen": "",
    "eh216s": "EH 216 S",
    "sparrow": "Sparrow",
    "type_b": "Type-B Firefighting UAV",
    "toucan": "Ramphastidae (toucan)",
}
"""Columns of the table and the subtypes whose samples they count, "" for all held-out ones."""
COLUMNS = (
    "choice",
    "section",
    "seeds",
    "seen_percent",
    *(
        f"{name}_{column}"
        for name in NAMED
        for column in ("percent", "low", "high", "difference", "difference_low", "difference_high")
    ),
    "worst",
    "core_s",
    "hardware",
    "physics",
)


def write_tables(table: dict, paths: dict[str, list[Path]], out: Path) -> None:
    """Write the tables of all rows that are trained."""
    seed = table["base"]["seed"]
    rows = []
    each = []
    base = None
    for choice, files in paths.items():
        every = [predictions.read(path) for path in files]
        held = [one.of(folds("unseen", "test")) for one in every]
        found = Held(held[0], [one.correct for one in held])
        base = base or found
        told = [json.loads(path.with_suffix(".json").read_text()) for path in files]
        cells = []
        for name in NAMED.values():
            cells += percents(found.difference(None, name, seed, choice))
            cells += percents(found.difference(base, name, seed, choice))
        seen = np.mean([one.of(folds("unseen", "seen_test")).correct.mean() for one in every])
        took = sum(part["train_processor_s"] for part in told)
        block = table["rows"][choice]
        rows.append(
            [
                choice,
                block["section"],
                len(files),
                *percents([seen]),
                *cells,
                found.worst(),
                f"{took:.0f}",
                told[0]["hardware"],
                block["physics"],
            ]
        )
        said, of = (
            np.concatenate([getattr(one, key) for one in held]) for key in ("guesses", "subtype")
        )
        for name in np.unique(of):
            shares = np.bincount(said[of == name], minlength=len(predictions.CATEGORIES)) / np.sum(
                of == name
            )
            each.append([choice, name, *percents([found.share(name), *shares])])
    decides = [COLUMNS.index(f"{name}_difference") for name in ("eh216s", "sparrow", "unseen")]
    rows.sort(key=lambda row: -sum(float(row[place]) for place in decides))
    write_csv(out / f"{table['name']}.csv", COLUMNS, rows)
    write_csv(
        out / f"{table['name']}-subtypes.csv",
        ("choice", "subtype", "right", *predictions.CATEGORIES),
        each,
    )
