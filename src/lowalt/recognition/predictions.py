"""The prediction file: class probabilities of every sample, as any other program can write it.

A CSV table, one row per sample, in any order. The command `score` needs only `key` and the
probabilities and takes the rest from the data set. Probabilities are not negative and sum to one
within 1e-3.

    key            the sample's key in the shards
    subtype, group, fold, model, snr_db, label    as in the sample's record ("inf" for no noise)
    range_m        distance of the nearest station that the model used; may be empty
    aspect_deg     the aspect seen from that station; may be empty
    p_uav, p_bird, p_vehicle, p_pedestrian
                   class probabilities, by the names and in the order of the classes
    part           of the training's protocol: "test" (its accuracy counts), "validation" or, in
                   the unseen protocol, "seen_test"; optional
"""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lowalt.config.classes import CATEGORIES, word
from lowalt.files.atomic import existing, text_file
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.files.json_objects import read_object
from lowalt.recognition.protocols import FOLDS
from lowalt.recognition.samples import Facts, motion_names

COLUMNS = ("key", "subtype", "group", "fold", "model", "snr_db", "label", "range_m", "aspect_deg")
"""Columns before the class probabilities."""


def probability_columns(classes: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the columns of class probabilities."""
    return tuple(f"p_{word(name)}" for name in classes)


def shares_of(row: dict, columns: tuple[str, ...], where: str) -> list[float]:
    """Return the class probabilities of a row of a prediction file; columns: theirs.

    Raises: InputError naming `where` for values that are not numbers, are negative, or do not sum
    to one.
    """
    try:
        values = [float(row[name]) for name in columns]
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}: {error}") from error
    if not (min(values) >= 0 and abs(sum(values) - 1) <= 1e-3):
        raise InputError(
            f"{where}: probabilities {values}, expected {len(columns)} >= 0 with sum 1"
        )
    return values


@dataclass(frozen=True)
class Predictions:
    """Columns of a prediction file: `probabilities` (samples, classes), all others (samples,)."""

    key: np.ndarray
    subtype: np.ndarray
    group: np.ndarray
    fold: np.ndarray
    model: np.ndarray
    snr_db: np.ndarray
    label: np.ndarray
    range_m: np.ndarray
    aspect_deg: np.ndarray
    probabilities: np.ndarray

    def __len__(self) -> int:
        return len(self.key)

    @property
    def motion(self) -> np.ndarray:
        """Name of each sample's motion model, (samples,) text."""
        return motion_names(self.subtype, self.model)

    @property
    def guesses(self) -> np.ndarray:
        """Most probable class, (samples,)."""
        return self.probabilities.argmax(1)

    @property
    def correct(self) -> np.ndarray:
        """Whether the most probable class is the true one, (samples,) bool."""
        return self.guesses == self.label

    def take(self, numbers: np.ndarray) -> "Predictions":
        """Return the rows `numbers` (indices or a mask)."""
        return Predictions(**{name: value[numbers] for name, value in vars(self).items()})

    def of(self, pairs: set[tuple[str, str]]) -> "Predictions":
        """Return the rows whose (group, fold) is among `pairs`, by key so that schemes align."""
        own_pairs = zip(self.group.tolist(), self.fold.tolist(), strict=True)
        inside = [pair in pairs for pair in own_pairs]
        rows = np.flatnonzero(inside)
        return self.take(rows[np.argsort(self.key[rows], kind="stable")])


def record(path: str | Path) -> dict:
    """Return the JSON record that goes with a prediction file.

    Raises: InputError where it is missing or no JSON object.
    """
    side = existing(Path(path).with_suffix(".json"), "run record")
    return read_object(side, "a run record")


def from_facts(facts: Facts, stations: tuple[int, ...], probabilities: np.ndarray) -> Predictions:
    """Return predictions for samples with these facts.

    Range and aspect are those of the nearest of `stations`.
    """
    ranges = facts.range_m[:, list(stations)]
    nearest = np.where(np.isnan(ranges), math.inf, ranges).argmin(1)
    rows = np.arange(len(facts))
    aspects = np.degrees(facts.aspect_rad[:, list(stations)][rows, nearest])
    return Predictions(
        key=facts.key,
        subtype=facts.subtype,
        group=facts.group,
        fold=facts.fold,
        model=facts.model,
        snr_db=facts.snr_db,
        label=facts.label,
        range_m=ranges[rows, nearest],
        aspect_deg=aspects,
        probabilities=probabilities,
    )


def _number(value: float) -> str:
    """A number as a cell of the file; NaN as an empty one."""
    if math.isnan(value):
        return ""
    return repr(float(value))


def write(
    path: str | Path,
    table: Predictions,
    classes: tuple[str, ...] = CATEGORIES,
    protocol: str | None = None,
) -> None:
    """Write a prediction file, with the column `part` for one of the protocols.

    Equal predictions give equal bytes.
    """
    part_of_fold: dict[tuple[str, str], str] = {}
    for part, pairs in FOLDS.get(protocol or "", {}).items():
        part_of_fold |= dict.fromkeys(pairs, part)
    columns = (*COLUMNS, *probability_columns(classes))
    if part_of_fold:
        columns += ("part",)
    write_csv(path, columns, (_cells(table, row, part_of_fold) for row in range(len(table))))


def _cells(table: Predictions, row: int, part_of_fold: dict[tuple[str, str], str]) -> list:
    """The cells of a row; part_of_fold: the protocol's part by (group, fold), empty for none."""
    cells = [
        table.key[row],
        table.subtype[row],
        table.group[row],
        table.fold[row],
        int(table.model[row]),
        _number(table.snr_db[row]),
        int(table.label[row]),
        _number(table.range_m[row]),
        _number(table.aspect_deg[row]),
    ]
    cells += [repr(float(value)) for value in table.probabilities[row]]
    if part_of_fold:
        cells.append(part_of_fold[table.group[row], table.fold[row]])
    return cells


def read(path: str | Path, classes: tuple[str, ...] = CATEGORIES) -> Predictions:
    """Read and check a prediction file of these classes.

    Raises: InputError naming the file, the line and what is wrong.
    """
    rows = []
    columns = probability_columns(classes)
    with text_file(path, "predictions") as file:
        reader = csv.DictReader(file)
        if tuple(name for name in reader.fieldnames or () if name != "part") != (
            *COLUMNS,
            *columns,
        ):
            raise InputError(
                f"{path}: columns {reader.fieldnames}, expected {[*COLUMNS, *columns]}"
            )
        for line, row in enumerate(reader, start=2):
            try:
                facts = (
                    row["key"],
                    row["subtype"],
                    row["group"],
                    row["fold"],
                    int(row["model"]),
                    float(row["snr_db"]),
                    int(row["label"]),
                    float(row["range_m"] or "nan"),
                    float(row["aspect_deg"] or "nan"),
                )
            except (TypeError, ValueError) as error:
                raise InputError(f"{path} line {line}: {error}") from error
            rows.append((*facts, shares_of(row, columns, f"{path} line {line}")))
    if not rows:
        raise InputError(f"{path}: no predictions")
    predictions = Predictions(*(np.array(column) for column in zip(*rows, strict=True)))
    if len(np.unique(predictions.key)) != len(predictions):
        raise InputError(f"{path}: a key stands twice, expected one row per sample")
    return predictions
