"""Checksums of the benchmark's bytes: of whole parts, and of a few samples that a test makes again.

Kept are `checksums.txt`, with a line "SHA-256  PART/FILE" for each file of signals and the files
they come from, and `samples.txt`, with one sample of each subtype, "SHA-256  PART/KEY". Records are
hashed without the version of the rules, which they name.
"""

import hashlib
import itertools
import json
import math
from collections.abc import Iterator
from pathlib import Path

from lowalt.extensions.benchmark.definition import PARTS, REFERENCE, config_of, run_name
from lowalt.files.atomic import replacing, sha256, text_of
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.shards.dataset import Dataset

FILES = ("clouds/*.npz", "motion/*.csv", "echo/*/*.npy", "noisy/*.npy")
"""Files of a part's run, in the order in which each makes the next. Images follow from the signals.
"""
WHOLE = "checksums.txt"
SAMPLES = "samples.txt"
FEW = {"low-snr": 8, "clutter": 8, "fr2": 8}
"""Number of subtypes of which a sample is kept, where it is not one of each: two of each class."""


def of_part(part: str, folder: str | Path) -> dict[str, str]:
    """Return the checksums of a part's files by PART/FILE; folder: where the runs' folders are.

    Raises: InputError where the part has no data.
    """
    run = Path(folder) / run_name(part)
    sums = {}
    for pattern in FILES:
        for path in sorted(run.glob(pattern)):
            sums[f"{part}/{path.relative_to(run).as_posix()}"] = sha256(path)
    if not sums:
        raise InputError(f"{run}: no data, expected those of `lowalt benchmark make`")
    return sums


def kept(name: str = WHOLE) -> dict[str, str]:
    """Return the kept checksums of all parts by PART/FILE, or by PART/KEY for the name SAMPLES."""
    sums = {}
    for line in text_of(shipped(f"{REFERENCE}/{name}"), "checksums").splitlines():
        digest, _, of_file = line.partition("  ")
        sums[of_file] = digest
    return sums


def _write(path: Path, sums: dict[str, str]) -> None:
    """Write checksums by name."""
    with replacing(path) as temporary:
        temporary.write_text("".join(f"{digest}  {name}\n" for name, digest in sums.items()))


def compared(part: str, folder: str | Path) -> list[str]:
    """Return how a part's files compare with the kept checksums.

    There is a line for each file that is missing, differs or is not kept, those of the earliest
    stage first. Raises: as `of_part`.
    """
    found = of_part(part, folder)
    wanted = {name: digest for name, digest in kept().items() if name.startswith(f"{part}/")}
    lines = []
    for name in wanted | found:
        if name not in found:
            lines.append(f"{name} is missing")
        elif name not in wanted:
            lines.append(f"{name} is not among the kept files")
        elif found[name] != wanted[name]:
            lines.append(f"{name} differs")
    return lines


def write(folder: str | Path, out: str | Path) -> None:
    """Write the checksums of all parts into the folder `out`.

    folder: where the runs' folders are.
    """
    sums: dict[str, str] = {}
    for part in PARTS:
        sums |= of_part(part, folder)
    _write(Path(out) / WHOLE, sums)


def write_samples(out: str | Path) -> None:
    """Make the samples of all parts and write their checksums into the folder `out`."""
    sums = {}
    for part in PARTS:
        for key, digest in samples(part):
            sums[f"{part}/{key}"] = digest
    _write(Path(out) / SAMPLES, sums)


def samples(part: str) -> Iterator[tuple[str, str]]:
    """Make one sample of each subtype of a part, or of some (FEW); yield its key and its SHA-256.

    The checksum covers the record without the version of its rules, the signals and the tile.
    """
    data = Dataset(config_of(part))
    names = list(itertools.chain.from_iterable(data.plan.groups.values()))
    snrs = data.plan.snrs
    step = math.ceil(len(names) / FEW.get(part, len(names)))
    for number in range(0, len(names), step):
        model = number % data.plan.models
        snr_db = snrs[number % len(snrs)]
        image, signal, record = data.made(data.place_of(names[number], model, snr_db))
        record.pop("versions")
        text = json.dumps(record, sort_keys=True).encode()
        yield record["key"], hashlib.sha256(text + signal.tobytes() + image.tobytes()).hexdigest()
