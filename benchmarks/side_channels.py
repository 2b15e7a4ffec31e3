"""Side channels of a data set: how often a classifier names the class from what is not the echo.

    .venv/bin/python benchmarks/side_channels.py --out results/benchmarks/side_channels.csv

The data set is made here, as signals, from the default with fewer motion models and the overlays
that are given. For each channel a random forest learns the class on four fifths of the motion
models and is tested on the rest, five times. `p_value` is the share of 1000 assignments of classes
to motion models, the true one and random ones, that are at least as accurate. Classes are balanced,
so a channel without information may fall below chance: of what a training has more, its test has
less. docs/benchmark-rules.md says what follows for a submission.
"""

import argparse
import tarfile
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.classes import classes_of, label
from lowalt.config.layers import SCHEMA, load, merge
from lowalt.config.splits import fold
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS
from lowalt.files.csv_tables import write_csv
from lowalt.numerics.normals import circular
from lowalt.numerics.streams import stream
from lowalt.shards import ShardSet
from lowalt.shards.build import write_run
from lowalt.shards.dataset import Dataset
from lowalt.targets.records import records_of
from lowalt.tiles.png import encode

COLUMNS = ("channel", "accuracy_percent", "chance_percent", "p_value", "samples", "verdict")
REPEATS = 999


class Evidence(NamedTuple):
    """A data set of signal shards with the records of its samples, both in the order of the index."""

    shards: ShardSet
    records: list[dict]


def place(found: Evidence) -> np.ndarray:
    """Position of each sample in its shard, and the number of the shard."""
    rows = [
        (number, at, at % 2, at % 3, at % 5, at / len(table), offset % 10240, before[at])
        for number, (_, table) in enumerate(found.shards.tables())
        for before in [np.diff(table["offset"], prepend=0)]
        for at, offset in enumerate(table["offset"].tolist())
    ]
    return np.array(rows, float)


def tar_headers(found: Evidence) -> np.ndarray:
    """Time, owner, group and mode of each sample's first member."""
    rows = []
    for entry, table in found.shards.tables():
        with tarfile.open(found.shards.index_path.parent / entry["path"]) as archive:
            members = {member.name.partition(".")[0]: member for member in archive}
        named = [members[key.decode()] for key in table["key"].tolist()]
        rows += [(m.mtime, m.uid, m.gid, m.mode, len(m.uname), len(m.gname)) for m in named]
    return np.array(rows, float)


def pngs(found: Evidence) -> list[bytes]:
    """The PNG file of each sample, as image shards hold it."""
    return [
        encode(found.shards.tile(number), found.shards.palette)
        for number in range(len(found.shards))
    ]


def png_apart_from_pixels(found: Evidence) -> np.ndarray:
    """Bytes of each PNG before and after its pixels."""
    return np.array([list(data[:33] + data[-12:]) for data in pngs(found)], float)


def low_bits(found: Evidence) -> np.ndarray:
    """Mean of each of the eight lowest bits of the stored numbers, by station."""
    words = np.stack([found.shards.signal(n).view(np.uint32) for n in range(len(found.shards))])
    return np.concatenate([(words >> bit & 1).mean(-1) for bit in range(8)], axis=1)


def levels_db(found: Evidence) -> np.ndarray:
    """Mean power (dB) of the signals of each station."""
    power = [
        np.mean(np.abs(found.shards.signal(n)) ** 2, axis=-1) for n in range(len(found.shards))
    ]
    return 10 * np.log10(np.array(power, float))


def leaves_below(*path: str) -> Callable[[Evidence], np.ndarray]:
    """A channel: all numbers below a place of the records."""

    def leaves(value: object) -> list[float]:
        """The numbers in a tree of dicts."""
        return (
            [n for item in value.values() for n in leaves(item)]
            if isinstance(value, dict)
            else [float(value)]
        )

    def channel(found: Evidence) -> np.ndarray:
        """The numbers of every record."""
        rows = []
        for record in found.records:
            value = record
            for name in path:
                value = value[name]
            rows.append(leaves(value))
        return np.array(rows, float)

    return channel


def column(name: str) -> Callable[[Evidence], np.ndarray]:
    """A channel: one column of the shards' tables."""
    return lambda found: (
        np.concatenate([table[name] for _, table in found.shards.tables()])
        .reshape(-1, 1)
        .astype(float)
    )


CHANNELS: dict[str, tuple[Callable[[Evidence], np.ndarray], str]] = {
    "position in the shard": (place, "chance"),
    "time, owner and mode in the tar": (tar_headers, "chance"),
    "group of subtypes": (
        lambda f: np.array([[r["group"] == "seen"] for r in f.records], float),
        "chance",
    ),
    "SNR": (lambda f: np.minimum(f.shards.snrs_db, 99).reshape(-1, 1), "chance"),
    "root seed in the record": (leaves_below("seed"), "chance"),
    "SHA-256 of the sample": (
        lambda f: np.concatenate([table["sha256"] for _, table in f.shards.tables()]),
        "chance",
    ),
    "PNG apart from its pixels": (png_apart_from_pixels, "chance"),
    "lowest bits of the signal": (low_bits, "chance"),
    "size of the PNG": (
        lambda f: np.array([[len(data)] for data in pngs(f)], float),
        "in the image",
    ),
    "level of the signal": (levels_db, "forbidden"),
    "key": (
        lambda f: np.array([list(k.ljust(12)[:12]) for k in f.shards.keys.tolist()], float),
        "forbidden",
    ),
    "size of the record": (column("record_size"), "forbidden"),
    "motion in the record": (leaves_below("motion"), "forbidden"),
    "range, direction and speed in the record": (leaves_below("geometry"), "forbidden"),
}
"""Features of each sample (n, any) by channel, and the verdict: `chance` is shown, `in the image`
follows from the pixels alone, `forbidden` names the class and may not be used."""


def from_known_seed(found: Evidence, chosen: np.ndarray) -> np.ndarray:
    """Answers for the chosen noisy samples of a program that knows the root seed.

    Each subtype has noise of its own. The answer is the class of the subtype whose noise correlates
    best with the signal of the first station.
    """
    label_of = {record["subtype"]: record["label"] for record in found.records}
    station, *_ = found.shards.index["render"]["network"]["stations"]
    answers = []
    for number in chosen.tolist():
        signal = found.shards.signal(number)[0]
        record = found.records[number]
        fits = {}
        for subtype in label_of:
            rng = stream(
                record["seed"], "noise", subtype, record["model"], station, record["snr_db"]
            )
            noise = circular(rng.bit_generator.random_raw(2 * len(signal)), 1.0)
            fits[subtype] = abs(np.vdot(noise[0] + 1j * noise[1], signal))
        answers.append(label_of[max(fits, key=fits.__getitem__)])
    return np.array(answers)


def absent_from_training(labels: np.ndarray, models: np.ndarray, trains: np.ndarray) -> np.ndarray:
    """Answers for all motion models by their numbers: the class of which the fewest with that
    number train.

    Ten consecutive motion models of a subtype hold exactly eight that train, so whoever does not
    train is tested.
    """
    count = np.zeros((models.max() + 1, labels.max() + 1))
    np.add.at(count, (models[trains], labels[trains]), 1)
    return count[models].argmin(1)


def by_number(config: dict, models: int = 250) -> tuple:
    """The row of a program that knows only the number of a motion model, and which ones train; no
    data is needed.
    """
    published = records_of(config["targets"])
    classes = classes_of({name: item["published"] for name, item in published.items()})
    rows = [
        (
            label(classes, item["published"]),
            number,
            fold(config["split"], config["seed"], name, number),
        )
        for name, item in published.items()
        for number in range(models)
    ]
    labels, numbers, folds = (np.array(column) for column in zip(*rows, strict=True))
    tested = folds == "test"
    answers = absent_from_training(labels, numbers, folds == "train")[tested]
    return row(
        "motion models absent from training",
        answers,
        labels[tested],
        np.arange(tested.sum()),
        "forbidden",
    )


def by_row() -> tuple:
    """The row of a program that knows only the number of a test sample's row in
    `lowalt.extensions.benchmark.load`.

    The track is `unseen`; no data is needed.
    """
    facts = TRACKS["unseen"].samples().facts
    number = np.arange(len(facts))
    features = np.stack([number, number % 2, number % 3, number % 5, number % 6], axis=1).astype(
        float
    )
    answers = learned(features, facts.label, facts.motion)
    return row(
        "row of `lowalt.extensions.benchmark.load`", answers, facts.label, facts.motion, "chance"
    )


def learned(features: np.ndarray, labels: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Answers (n,) of random forests, each trained without the motion models that it answers for."""
    from sklearn.ensemble import RandomForestClassifier
    from sklearn.model_selection import StratifiedGroupKFold, cross_val_predict

    forest = RandomForestClassifier(100, min_samples_leaf=3, random_state=0)
    # Parts of unequal classes would make the most frequent class of a training the least frequent
    # of its test.
    parts = StratifiedGroupKFold(5, shuffle=True, random_state=0)
    return cross_val_predict(forest, features, labels, groups=groups, cv=parts)


def chance_of(answers: np.ndarray, labels: np.ndarray, groups: np.ndarray) -> float:
    """Share of assignments of the labels to the groups, the true one and random ones, that are at
    least as accurate.
    """
    _, first, which = np.unique(groups, return_index=True, return_inverse=True)
    rng = np.random.default_rng(0)
    drawn = [np.mean(answers == rng.permutation(labels[first])[which]) for _ in range(REPEATS)]
    return (1 + int(np.sum(np.array(drawn) >= np.mean(answers == labels)))) / (1 + REPEATS)


def row(
    channel: str, answers: np.ndarray, labels: np.ndarray, groups: np.ndarray, verdict: str
) -> tuple:
    """One row of the table."""
    right = np.mean(answers == labels)
    most = np.bincount(labels).max() / len(labels)
    p_value = chance_of(answers, labels, groups)
    return (
        channel,
        f"{100 * right:.1f}",
        f"{100 * most:.1f}",
        f"{p_value:.3f}",
        len(labels),
        verdict,
    )


def measured(found: Evidence) -> list[tuple]:
    """Every channel's row."""
    labels = np.array([record["label"] for record in found.records])
    groups = np.array([f"{record['subtype']} {record['model']}" for record in found.records])
    rows = [
        row(name, learned(features(found), labels, groups), labels, groups, verdict)
        for name, (features, verdict) in CHANNELS.items()
    ]
    noisy = np.flatnonzero([record["noise"] for record in found.records])
    answers = from_known_seed(found, noisy)
    rows.append(
        row("noise of the known root seed", answers, labels[noisy], groups[noisy], "forbidden")
    )
    small = np.stack([found.shards.tile(n)[::24, ::24].ravel() for n in range(len(labels))])
    tested = np.array([int(record["fold"] == "test") for record in found.records])
    rows.append(
        row(
            "whether the image is tested on",
            learned(small, tested, groups),
            tested,
            groups,
            "chance",
        )
    )
    return rows


def evidence(config: dict, folder: Path) -> Evidence:
    """Write the data set of a configuration below a folder, and return it."""
    write_run(Dataset(config), folder, "signal", clouds=False)
    shards = ShardSet(folder / "shards/index.json")
    return Evidence(shards, [shards.record(number) for number in range(len(shards))])


def main() -> None:
    """Make the data set, measure every channel and write the table."""
    line = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    line.add_argument("--configfile", nargs="*", default=[], help="overlays on config/default.yaml")
    line.add_argument(
        "--models", type=int, default=20, help="motion models per subtype (default 20)"
    )
    line.add_argument("--out", type=Path, required=True, help="table to write (.csv)")
    options = line.parse_args()
    fewer = {
        "motion": {"models": options.models, "models_per_chunk": 10},
        "noise": {"snr_db": [3, float("inf")]},
    }
    config = merge(load(["config/default.yaml", *options.configfile], SCHEMA), fewer)
    with tempfile.TemporaryDirectory() as folder:
        rows = measured(evidence(config, Path(folder)))
    write_csv(options.out, COLUMNS, [*rows, by_number(config), by_row()])


if __name__ == "__main__":
    main()
