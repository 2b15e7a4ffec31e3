"""Checksums of the benchmark's bytes: of whole parts, and of a few samples that a test makes again.

Kept are `checksums.txt`, with a line "SHA-256  PART/FILE" for each file of signals and the files they come from, and
`samples.txt`, with one sample of each subtype, "SHA-256  PART/KEY". Records are hashed without the version
of the rules, which they name. The last bits of a part with effects depend on the processor, so PART-sums.npy keeps a
sum per motion model and station, which tells such a difference from a real one.
"""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.benchmark.definition import PARTS, REFERENCE, config_of, run_name
from lowalt.files.atomic import replacing, sha256, text_of
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.shards.dataset import Dataset

FILES = ("clouds/*.npz", "motion/*.csv", "echo/*/*.npy", "noisy/*.npy")
"""Files of a part's run, in the order in which each makes the next. Images follow from the signals."""
WHOLE, SAMPLES = "checksums.txt", "samples.txt"
FEW = {"low-snr": 8, "clutter": 8, "fr2": 8}
"""Number of subtypes of which a sample is kept, where it is not one of each: two of each class."""

CLOSE = 1e-6
"""Largest difference of two sums of a motion model's signals in their last bits alone, relative to the signals' norm:
ten units in the last place of float32."""


class Compared(NamedTuple):
    """How a part compares with what is kept: a line for each file that is missing, differs or is not kept, those of the
    earliest stage first; and the files that differ in the last bits of their signals alone."""

    faults: list[str]
    close: list[str]


def of_part(part: str, folder: str | Path) -> dict[str, str]:
    """Return the checksums of a part's files by PART/FILE; folder: where the runs' folders are.

    Raises: InputError where the part has no data.
    """
    run = Path(folder) / run_name(part)
    paths = [path for pattern in FILES for path in sorted(run.glob(pattern))]
    if not paths:
        raise InputError(f"{run}: no data, expected those of `lowalt benchmark make`")
    return {f"{part}/{path.relative_to(run).as_posix()}": sha256(path) for path in paths}


def kept(name: str = WHOLE) -> dict[str, str]:
    """Return the kept checksums of all parts by PART/FILE, or by PART/KEY for the name SAMPLES."""
    lines = text_of(shipped(f"{REFERENCE}/{name}"), "checksums").splitlines()
    return {name: digest for digest, _, name in (line.partition("  ") for line in lines)}


def _write(path: Path, sums: dict[str, str]) -> None:
    """Write checksums by name."""
    with replacing(path) as temporary:
        temporary.write_text("".join(f"{digest}  {name}\n" for name, digest in sums.items()))


def compared(part: str, folder: str | Path) -> Compared:
    """Return how a part's files compare with the kept checksums and sums. Raises: as `of_part`."""
    found = of_part(part, folder)
    wanted = {name: digest for name, digest in kept().items() if name.startswith(f"{part}/")}
    words = {name: "is missing" for name in wanted if name not in found}
    words |= {name: "differs" for name, digest in found.items() if wanted.get(name, digest) != digest}
    words |= {name: "is not among the kept files" for name in found if name not in wanted}
    signals = {name for name, word in words.items() if word == "differs" and name.split("/")[1] in ("echo", "noisy")}
    if config_of(part)["effects"] and signals == set(words) and _agree(part, folder):
        return Compared([], sorted(words))
    return Compared([f"{name} {words[name]}" for name in {**wanted, **found} if name in words], [])


def sums(part: str, folder: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the sum (models, stations) complex128 of each motion model's signals, its values turned by random
    quarter turns, and the signals' norm (models, stations).
    """
    found = []
    for path in sorted((Path(folder) / run_name(part) / "noisy").glob("*.npy")):
        for model in np.load(path, mmap_mode="r").swapaxes(1, 2):
            draws = np.random.PCG64(0).random_raw(model[0].size) % np.uint64(4)
            turned = model.reshape(len(model), -1) * np.array([1, 1j, -1, -1j])[draws]
            found.append((turned.sum(axis=1), np.linalg.norm(turned, axis=1)))
    return tuple(np.stack(column) for column in zip(*found, strict=True))


def _agree(part: str, folder: str | Path) -> bool:
    """Whether the sums of a part's signals are the kept ones up to last bits."""
    (here, norm), there = sums(part, folder), np.load(shipped(f"{REFERENCE}/{part}-sums.npy"))
    return here.shape == there.shape and bool((abs(here - there) <= CLOSE * norm).all())


def write(folder: str | Path, out: str | Path) -> None:
    """Write the checksums and sums of all parts into the folder `out`; folder: where the runs' folders are."""
    for part in PARTS:
        if config_of(part)["effects"]:
            with replacing(Path(out) / f"{part}-sums.npy") as temporary, temporary.open("wb") as file:
                np.save(file, sums(part, folder)[0].astype(np.complex64))
    _write(Path(out) / WHOLE, {name: digest for part in PARTS for name, digest in of_part(part, folder).items()})


def write_samples(out: str | Path) -> None:
    """Make the samples of all parts and write their checksums into the folder `out`."""
    _write(Path(out) / SAMPLES, {f"{part}/{key}": digest for part in PARTS for key, digest in samples(part)})


def samples(part: str) -> Iterator[tuple[str, str]]:
    """Make one sample of each subtype of a part (or of some, FEW) and yield its key and its SHA-256.

    The checksum covers the record without the version of its rules, the signals and the tile.
    """
    data = Dataset(config_of(part))
    names, snrs = [name for members in data.plan.groups.values() for name in members], data.plan.snrs
    step = -(-len(names) // FEW.get(part, len(names)))
    for number, name in list(enumerate(names))[::step]:
        place = data.place_of(name, number % data.plan.models, snrs[number % len(snrs)])
        image, signal, record = data.made(place)
        record.pop("versions")
        text = json.dumps(record, sort_keys=True).encode()
        yield record["key"], hashlib.sha256(text + signal.tobytes() + image.tobytes()).hexdigest()
