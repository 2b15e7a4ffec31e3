"""The measured sets: which files belong to them, which half each is in, and their intervals that hold a target.

The file of sets holds records whose `file` is a pattern inside the set's folder, the file of the split the two halves
by file name. Files that came later are in neither half's list: they are test files.
"""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.yaml_files import load_yaml
from lowalt.recordings.channel import coherent_intervals, symbol_rate
from lowalt.recordings.figures import speeds_shown
from lowalt.recordings.files import Baseband, read
from lowalt.recordings.record import Record, record
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
                half = "tuning" if path.name in half_of.get(name, {}).get("tuning", ()) else "test"
                seen[path.name] = Measured(name, half, replace(one, file=path))
        found += [seen[key] for key in sorted(seen)]
    if not found:
        raise InputError(f"{inputs}: no recordings of {sorted(blocks)}, expected a folder a set")
    return found


def at_carrier(twin: Twin, carrier_hz: float) -> Twin:
    """Return the twin at a recording's own carrier; the symbol interval stays, so the speeds scale a little."""
    return replace(twin, carrier_hz=carrier_hz)


def present(intervals: np.ndarray, twin: Twin) -> np.ndarray:
    """Return which intervals (n, symbols) hold a moving target, (n,) bool.

    The strongest line at |speed| >= slowest_mps stands `detect_db` above the median of those speeds, Hann window: a
    constant false alarm rate. With detect_db 0 all do: the target never left the radar.
    """
    if not twin.detect_db:
        return np.ones(len(intervals), bool)
    count = intervals.shape[1]
    power = np.abs(np.fft.fft(intervals * np.hanning(count), axis=1)) ** 2
    speeds = np.fft.fftshift(np.fft.fftfreq(count)) * 2 * twin.edge_mps
    order, meant = speeds_shown(speeds, twin.edge_mps, twin.sides)
    moving = np.fft.fftshift(power, axes=1)[:, order][:, np.abs(meant) >= twin.slowest_mps]
    return moving.max(axis=1) >= 10 ** (twin.detect_db / 10) * np.median(moving, axis=1)


def measured_intervals(one: Measured, twin: Twin, baseband: Baseband | None = None) -> np.ndarray:
    """Return a recording's coherent intervals that hold a target, (n, symbols) complex128 at the twin's symbol rate.

    Raises: InputError as `read`, and where the recording is shorter than one interval.
    """
    values, rate = baseband or read(one.record)
    signal = symbol_rate(values, rate, twin.symbol_interval_s, twin.sampling)
    found = coherent_intervals(signal, twin.symbols, name=str(one.record.file))
    return found[present(found, twin)]
