"""The measured sets: which files belong to them, which half each is in, and their intervals that hold a target.

The file of sets holds records whose `file` is a pattern inside the set's folder. The file of the split lists the files
of both halves by name; a file that is in neither list is a test file. A record next to a file (any .yaml in the set's
folder) takes precedence over the set's pattern, so a file of any name, rate and channel can be added.

Two keys stand only in records of sets: `rates_hz`, the possible rates of the set's files, of which each file's sample
times select one; and `carrier_ghz_in_name`, a regular expression whose group is the carrier (GHz) in the file's name.
`carrier_hz` then serves files without a carrier in their names.
Another folder becomes a set by its file `set.yaml`: `like`, a set of the same radar, and `files`, its records.
"""

import re
import sys
from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.classes import CATEGORIES
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.recordings.channel import coherent_intervals, symbol_rate
from lowalt.recordings.files import Baseband, read
from lowalt.recordings.formats import READERS
from lowalt.recordings.presence import present
from lowalt.recordings.record import Record, read_record, record
from lowalt.recordings.twin import Twin

HALVES = ("tuning", "test")


OWN = "set.yaml"
"""Name of the file that makes a folder a set."""


class Measured(NamedTuple):
    """One recording of a set: `half` is "tuning" or "test", `like` the known set of the same radar."""

    set: str
    half: str
    record: Record
    like: str

    @property
    def name(self) -> str:
        """File name, which is unique in a set."""
        return self.record.file.name


def halves(path: str | Path) -> dict[str, dict[str, list[str]]]:
    """Return set -> half -> file names.

    Raises: InputError where a set lacks a half, or names a file twice.
    """
    found = load_yaml(path, "split of the recordings", "sets to their halves")
    for name, block in found.items():
        if not isinstance(block, dict) or set(block) != set(HALVES):
            raise InputError(f"{path}: {name} is {block!r:.80}, expected exactly {HALVES}")
        both = [file for half in HALVES for file in block[half]]
        twice = sorted({file for file in both if both.count(file) > 1})
        if twice:
            raise InputError(f"{path}: {name} names {twice} twice, expected every file in one half")
    return found


def _labelled(path: Path) -> Record:
    """Return the record in a file of a set's folder; refuse one without a label, which every comparison needs."""
    one = read_record(path)
    if one.label is None:
        raise InputError(f"{path}: no label, expected one of {CATEGORIES}")
    return one


def _record_of(block: dict, path: Path, where: str) -> Record:
    """The record of one file of a set, its carrier read from its name where the set says so."""
    plain = {key: item for key, item in block.items() if key not in ("carrier_ghz_in_name", "rates_hz")}
    found = re.search(block.get("carrier_ghz_in_name", "(?!)"), path.name)
    if found:
        plain["carrier_hz"] = float(found[1]) * 1e9
    rates = block.get("rates_hz")
    return replace(record(plain, path.parent, where), file=path, rates_hz=None if rates is None else tuple(rates))


def _files(folder: Path, patterns: list[dict], where: str) -> dict[str, Record]:
    """Records by file name of one set's folder; files that no record describes are named on standard error."""
    seen: dict[str, Record] = {}
    for number, block in enumerate(patterns):
        for path in sorted(folder.glob("*")):
            if not fnmatch(path.name.lower(), block["file"].lower()):
                continue
            if path.name in seen:
                raise InputError(f"{where}: {path.name} fits two patterns, expected one")
            seen[path.name] = _record_of(block, path, f"{where}[{number}]")
    own = [path for path in sorted(folder.glob("*.yaml")) if path.name != OWN]
    seen |= {one.file.name: one for one in map(_labelled, own)}
    for path in sorted(folder.glob("*")):
        if path.suffix.lower() in READERS and path.name not in seen:
            print(f"{path}: left out, no pattern of its set and no record fits", file=sys.stderr)
    return seen


def _blocks(inputs: Path, sets: str | Path) -> dict[str, tuple[str, list[dict]]]:
    """Set -> (known set of the same radar, records): the known sets and the folders that have a file of their own."""
    known = load_yaml(sets, "measured sets", "sets to their records")
    blocks = {name: (name, patterns) for name, patterns in known.items()}
    for folder in sorted(path for path in inputs.glob("*") if path.is_dir() and path.name not in known):
        if not (folder / OWN).is_file():
            print(f"{folder}: left out, no set of that name and no {OWN} in it", file=sys.stderr)
            continue
        own = load_yaml(folder / OWN, "set of recordings", "like and files")
        if set(own) != {"like", "files"} or own["like"] not in known or not isinstance(own["files"], list):
            raise InputError(f"{folder / OWN}: expected files, a list of records, and like, one of {sorted(known)}")
        blocks[folder.name] = own["like"], own["files"]
    return blocks


def recordings(inputs: str | Path, sets: str | Path, split: str | Path) -> list[Measured]:
    """Return the recordings there are below the folder `inputs`, one folder a set, in the order of sets and names.

    A set whose folder is missing is left out. Raises: InputError where no recording is there, a record is wrong, or a
    file fits two patterns of its set.
    """
    blocks, half_of = _blocks(Path(inputs), sets), halves(split)
    found = []
    for name, (like, patterns) in blocks.items():
        where = f"{sets}: {name}" if like == name else str(Path(inputs) / name / OWN)
        seen = _files(Path(inputs) / name, patterns, where)
        tuning = half_of.get(name, {}).get("tuning", ())
        found += [Measured(name, "tuning" if key in tuning else "test", seen[key], like) for key in sorted(seen)]
    if not found:
        raise InputError(f"{inputs}: no recordings of {sorted(blocks)}, expected a folder a set")
    return found


def at_carrier(twin: Twin, carrier_hz: float) -> Twin:
    """Return the twin at a recording's own carrier; the symbol interval stays, so the speeds scale a little."""
    return replace(twin, carrier_hz=carrier_hz)


def sampled(one: Record, twin: Twin, baseband: Baseband | None = None) -> np.ndarray:
    """Return a recording's signal (symbols,) complex128 at the twin's symbol rate.

    Where the radar has one real channel, the first of a recording's two is taken.
    Raises: InputError as `read`, naming the file: for a real recording where the radar has two channels, and for one
    slower than a sample a symbol.
    """
    values, rate = baseband or read(one)
    if one.channel == "real" and twin.channel == "complex":
        raise InputError(
            f"{one.file}: channel 'real', but the radar has a complex channel, expected in-phase and quadrature"
        )
    if one.channel == "complex" and twin.channel == "real":
        values = values.real
    try:
        return symbol_rate(values, rate, twin.symbol_interval_s, twin.sampling)
    except InputError as error:
        raise InputError(f"{one.file}: {error}") from None


def measured_intervals(one: Measured, twin: Twin, baseband: Baseband | None = None) -> np.ndarray:
    """Return a recording's coherent intervals that hold a target, (n, symbols) complex128 at the twin's symbol rate.

    Raises: InputError as `read`, and where the recording is shorter than one interval.
    """
    found = coherent_intervals(sampled(one.record, twin, baseband), twin.symbols, name=str(one.record.file))
    return found[present(found, twin)]


def usable(found: list[Measured], twins: dict[str, Twin]) -> list[Measured]:
    """Return the recordings that can be read and cut into intervals; the others are named on standard error.

    twins: known set -> its radar's twin. Raises: InputError where none can be used.
    """
    good = []
    for one in found:
        try:
            measured_intervals(one, at_carrier(twins[one.like], one.record.carrier_hz))
            good.append(one)
        except InputError as error:
            print(f"left out: {error}", file=sys.stderr)
    if not good:
        raise InputError(f"none of {len(found)} recordings can be used, expected at least one")
    return good
