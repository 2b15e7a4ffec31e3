"""Side channels of a data set: how often a classifier names the class from what is not the echo.

    .venv/bin/python benchmarks/side_channels.py --out results/benchmarks/side_channels.csv

The data set is made here, as signals, from the default with fewer motion models and the overlays that are given. For
each channel a random forest learns the class on four fifths of the motion models and is tested on the rest, five times.
`p_value` is the share of 1000 random assignments of classes to motion models that are at least as far from chance, of
which the measured assignment is one.
docs/benchmark-rules.md says what follows for a submission.
"""

import argparse
import tarfile
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.layers import SCHEMA, load, merge
from lowalt.files.csv_tables import write_csv
from lowalt.numerics.normals import circular
from lowalt.numerics.streams import stream
from lowalt.shards import ShardSet
from lowalt.shards.build import write_run
from lowalt.shards.dataset import Dataset
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
    return [encode(found.shards.tile(number), found.shards.palette) for number in range(len(found.shards))]


def png_beside_pixels(found: Evidence) -> np.ndarray:
    """Bytes of each PNG before and after its pixels."""
    return np.array([list(data[:33] + data[-12:]) for data in pngs(found)], float)


def low_bits(found: Evidence) -> np.ndarray:
    """Mean of each of the eight lowest bits of the stored numbers, by station."""
    words = np.stack([found.shards.signal(n).view(np.uint32) for n in range(len(found.shards))])
    return np.concatenate([(words >> bit & 1).mean(-1) for bit in range(8)], axis=1)


def levels_db(found: Evidence) -> np.ndarray:
    """Mean power (dB) of the signals of each station."""
    power = [np.mean(np.abs(found.shards.signal(n)) ** 2, axis=-1) for n in range(len(found.shards))]
    return 10 * np.log10(np.array(power, float))


def numbers(*path: str) -> Callable[[Evidence], np.ndarray]:
    """A channel: all numbers below a place of the records."""

    def leaves(value: object) -> list[float]:
        """The numbers in a tree of dicts."""
        return [n for item in value.values() for n in leaves(item)] if isinstance(value, dict) else [float(value)]

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
        np.concatenate([table[name] for _, table in found.shards.tables()]).reshape(-1, 1).astype(float)
    )


CHANNELS: dict[str, tuple[Callable[[Evidence], np.ndarray], str]] = {
    "position in the shard": (place, "chance"),
    "time, owner and mode in the tar": (tar_headers, "chance"),
    "group of subtypes": (lambda f: np.array([[r["group"] == "seen"] for r in f.records], float), "chance"),
    "SNR": (lambda f: np.minimum(f.shards.snrs_db, 99).reshape(-1, 1), "chance"),
    "root seed in the record": (numbers("seed"), "chance"),
    "SHA-256 of the sample": (lambda f: np.concatenate([table["sha256"] for _, table in f.shards.tables()]), "chance"),
    "PNG beside its pixels": (png_beside_pixels, "chance"),
    "lowest bits of the signal": (low_bits, "chance"),
    "size of the PNG": (lambda f: np.array([[len(data)] for data in pngs(f)], float), "in the image"),
    "level of the signal": (levels_db, "forbidden"),
    "key": (lambda f: np.array([list(k.ljust(12)[:12]) for k in f.shards.keys.tolist()], float), "forbidden"),
    "size of the record": (column("record_size"), "forbidden"),
    "motion in the record": (numbers("motion"), "forbidden"),
    "range, direction and speed in the record": (numbers("geometry"), "forbidden"),
}  # fmt: skip
"""Features of each sample (n, any) by channel, and the verdict: `chance` is shown, `in the image` follows from the
pixels alone, `forbidden` names the class and may not be used."""


def from_known_seed(found: Evidence, chosen: np.ndarray) -> np.ndarray:
    """Answers for the chosen noisy samples of a program that knows the root seed.

    Each subtype has noise of its own. The answer is the class of the subtype whose noise correlates best with the
    signal of the first station.
    """
    label_of = {record["subtype"]: record["label"] for record in found.records}
    (station, *_) = found.shards.index["render"]["network"]["stations"]
    answers = []
    for number in chosen.tolist():
        signal, record = found.shards.signal(number)[0], found.records[number]
        fits = {}
        for subtype in label_of:
            rng = stream(record["seed"], "noise", subtype, record["model"], station, record["snr_db"])
            noise = circular(rng.bit_generator.random_raw(2 * len(signal)), 1.0)
            fits[subtype] = abs(np.vdot(noise[0] + 1j * noise[1], signal))
        answers.append(label_of[max(fits, key=fits.__getitem__)])
    return np.array(answers)


def absent_from_training(found: Evidence, chosen: np.ndarray) -> np.ndarray:
    """Answers for the chosen test samples by their motion models' numbers: the class that trains least on that number.

    A block of ten motion models of a subtype has exactly eight that train, so whoever does not train is tested.
    """
    count = np.zeros((1 + max(r["model"] for r in found.records), len(found.shards.classes)))
    for record in found.records:
        count[record["model"], record["label"]] += record["fold"] == "train"
    return count[[found.records[number]["model"] for number in chosen.tolist()]].argmin(1)


def learned(features: np.ndarray, labels: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Answers (n,) of random forests, each trained without the motion models that it answers for."""
    from sklearn.ensemble import RandomForestClassifier
    from sklearn.model_selection import StratifiedGroupKFold, cross_val_predict

    forest = RandomForestClassifier(100, min_samples_leaf=3, random_state=0)
    # Parts of unequal classes would make the most frequent class of a training the least frequent of its test.
    parts = StratifiedGroupKFold(5, shuffle=True, random_state=0)
    return cross_val_predict(forest, features, labels, groups=groups, cv=parts)


def chance_of(answers: np.ndarray, labels: np.ndarray, groups: np.ndarray) -> float:
    """Share of random assignments of the labels to the groups whose accuracy is at least as far from their mean."""
    _, first, which = np.unique(groups, return_index=True, return_inverse=True)
    rng = np.random.default_rng(0)
    drawn = [np.mean(answers == rng.permutation(labels[first])[which]) for _ in range(REPEATS)]
    middle = np.mean(drawn)
    return (1 + int(np.sum(abs(drawn - middle) >= abs(np.mean(answers == labels) - middle)))) / (1 + REPEATS)


def row(channel: str, answers: np.ndarray, labels: np.ndarray, groups: np.ndarray, verdict: str) -> tuple:
    """One row of the table."""
    right, most = np.mean(answers == labels), np.bincount(labels).max() / len(labels)
    p_value = chance_of(answers, labels, groups)
    return channel, f"{100 * right:.1f}", f"{100 * most:.1f}", f"{p_value:.3f}", len(labels), verdict


def measured(found: Evidence) -> list[tuple]:
    """Every channel's row."""
    labels = np.array([record["label"] for record in found.records])
    groups = np.array([f"{record['subtype']} {record['model']}" for record in found.records])
    rows = [row(name, learned(features(found), labels, groups), labels, groups, verdict)
            for name, (features, verdict) in CHANNELS.items()]  # fmt: skip
    noisy = np.flatnonzero([record["noise"] for record in found.records])
    answers = from_known_seed(found, noisy)
    rows.append(row("noise of the known root seed", answers, labels[noisy], groups[noisy], "forbidden"))
    asked = np.flatnonzero([record["fold"] == "test" for record in found.records])
    answers = absent_from_training(found, asked)
    rows.append(row("motion models absent from training", answers, labels[asked], groups[asked], "forbidden"))
    small = np.stack([found.shards.tile(n)[::24, ::24].ravel() for n in range(len(labels))])
    tested = np.array([int(record["fold"] == "test") for record in found.records])
    rows.append(row("whether the image is tested on", learned(small, tested, groups), tested, groups, "chance"))
    return rows


def evidence(config: dict, folder: Path) -> Evidence:
    """Write the data set of a configuration below a folder, and return it."""
    write_run(Dataset(config), folder, "signal", clouds=False)
    shards = ShardSet(folder / "shards/index.json")
    return Evidence(shards, [shards.record(number) for number in range(len(shards))])


def main() -> None:
    """Make the data set, measure every channel and write the table."""
    line = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    line.add_argument("--configfile", nargs="*", default=[], help="overlays on config/default.yaml")
    line.add_argument("--models", type=int, default=20, help="motion models per subtype (default 20)")
    line.add_argument("--out", type=Path, required=True, help="table to write (.csv)")
    options = line.parse_args()
    fewer = {"motion": {"models": options.models, "models_per_chunk": 10}, "noise": {"snr_db": [3, float("inf")]}}
    config = merge(load(["config/default.yaml", *options.configfile], SCHEMA), fewer)
    with tempfile.TemporaryDirectory() as folder:
        write_csv(options.out, COLUMNS, measured(evidence(config, Path(folder))))


if __name__ == "__main__":
    main()
