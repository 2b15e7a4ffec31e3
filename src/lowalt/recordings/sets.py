"""The measured sets: which files belong to them, which half each is in, and their intervals that hold a target.

The file of sets holds records whose `file` is a pattern inside the set's folder, the file of the split the two halves
by file name. Files that came later are in neither half's list: they are test files. A record of its own next to a file
(any .yaml in the set's folder) goes before the set's pattern, so a file of any name, rate and channel can be added.
"""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.common.classes import CATEGORIES
from lowalt.common.errors import InputError
from lowalt.common.yaml_files import load_yaml
from lowalt.recordings.channel import coherent_intervals, symbol_rate
from lowalt.recordings.files import Baseband, read
from lowalt.recordings.presence import present
from lowalt.recordings.record import Record, read_record, record
from lowalt.recordings.twin import Twin

HALVES = ("tuning", "test")


class Measured(NamedTuple):
    """One recording of a set: `half` is "tuning" or "test"."""

    set: str
    half: str
    record: Record

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
    """The record in a file of a set's folder; only one with a label can be held against anything."""
    one = read_record(path)
    if one.label is None:
        raise InputError(f"{path}: no label, expected one of {CATEGORIES}")
    return one


def recordings(inputs: str | Path, sets: str | Path, split: str | Path) -> list[Measured]:
    """Return the recordings there are below the folder `inputs`, one folder a set, in the order of sets and names.

    A set whose folder is missing is left out. Raises: InputError where no set is there, a record is wrong, or a file
    fits two patterns of its set.
    """
    blocks = load_yaml(sets, "measured sets", "sets to their records")
    half_of = halves(split)
    found = []
    for name, patterns in blocks.items():
        folder, seen = Path(inputs) / name, {}
        for number, block in enumerate(patterns):
            one = record(block, folder, f"{sets}: {name}[{number}]")
            for path in sorted(folder.glob(block["file"])):
                if path.name in seen:
                    raise InputError(f"{sets}: {path.name} fits two patterns of {name}, expected one")
                seen[path.name] = replace(one, file=path)
        seen |= {one.file.name: one for one in map(_labelled, sorted(folder.glob("*.yaml")))}
        tuning = half_of.get(name, {}).get("tuning", ())
        found += [Measured(name, "tuning" if key in tuning else "test", seen[key]) for key in sorted(seen)]
    if not found:
        raise InputError(f"{inputs}: no recordings of {sorted(blocks)}, expected a folder a set")
    return found


def at_carrier(twin: Twin, carrier_hz: float) -> Twin:
    """Return the twin at a recording's own carrier; the symbol interval stays, so the speeds scale a little."""
    return replace(twin, carrier_hz=carrier_hz)


def sampled(one: Record, twin: Twin, baseband: Baseband | None = None) -> np.ndarray:
    """Return a recording's signal (symbols,) complex128 at the twin's symbol rate.

    A radar with one real channel hears the first of a recording's two.
    Raises: InputError as `read`, and for a real recording where the radar has two channels.
    """
    values, rate = baseband or read(one)
    if one.channel == "real" and twin.channel == "complex":
        raise InputError(f"{one.file}: channel 'real', but the radar has a complex channel")
    if one.channel == "complex" and twin.channel == "real":
        values = values.real
    return symbol_rate(values, rate, twin.symbol_interval_s, twin.sampling)


def measured_intervals(one: Measured, twin: Twin, baseband: Baseband | None = None) -> np.ndarray:
    """Return a recording's coherent intervals that hold a target, (n, symbols) complex128 at the twin's symbol rate.

    Raises: InputError as `read`, and where the recording is shorter than one interval.
    """
    found = coherent_intervals(sampled(one.record, twin, baseband), twin.symbols, name=str(one.record.file))
    return found[present(found, twin)]
