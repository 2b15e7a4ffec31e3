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
from lowalt.recordings.files import Baseband, read
from lowalt.recordings.record import Record, record
from lowalt.recordings.twin import Twin

HALVES = ("tuning", "test")
PRESENT_DB = 6.0
"""An interval holds a target where its moving power is so far above the tenth percentile of the recording's."""


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


def moving_power(intervals: np.ndarray, twin: Twin) -> np.ndarray:
    """Return the power (n,) of intervals (n, symbols) at speeds of at least the twin's `slowest_mps`; Hann window."""
    spectra = np.abs(np.fft.fft(intervals * np.hanning(intervals.shape[1]), axis=1)) ** 2
    speeds = np.fft.fftfreq(intervals.shape[1]) * 2 * twin.edge_mps
    return spectra[:, np.abs(speeds) >= twin.slowest_mps].sum(axis=1)


def present(intervals: np.ndarray, twin: Twin) -> np.ndarray:
    """Return which intervals (n, symbols) hold a moving target, (n,) bool.

    A recording that a target never leaves has much the same power in all intervals, and keeps all of them: the rule
    only sorts where the ninth decile is `PRESENT_DB` above the first.
    """
    power = 10 * np.log10(moving_power(intervals, twin) + 1e-300)
    floor = np.quantile(power, 0.1)
    if np.quantile(power, 0.9) < floor + PRESENT_DB:
        return np.ones(len(intervals), bool)
    return power >= floor + PRESENT_DB


def measured_intervals(one: Measured, twin: Twin, baseband: Baseband | None = None) -> np.ndarray:
    """Return a recording's coherent intervals that hold a target, (n, symbols) complex128 at the twin's symbol rate.

    Raises: InputError as `read`, and where the recording is shorter than one interval.
    """
    values, rate = baseband or read(one.record)
    signal = symbol_rate(values, rate, twin.symbol_interval_s, twin.sampling)
    found = coherent_intervals(signal, twin.symbols, name=str(one.record.file))
    return found[present(found, twin)]
