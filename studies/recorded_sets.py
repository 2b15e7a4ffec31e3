"""Sets of measured recordings: which files belong to them, which half each is in, and their windows
with a target.

A file of sets holds records whose `file` is a pattern inside the set's folder. A file of the split
lists the files of both halves by name; a file that is in neither list is a test file. A record next
to a file (any .yaml in the set's folder) takes precedence over the set's pattern, so a file of any
name, rate and channel can be added.

Four keys stand only in records of sets: `radar`, the record in `config/measured/radars` of the
radar that they are of; `rates_hz`, the possible rates of the set's files, of which each file's
sample times select one; `carrier_ghz_in_name`, a regular expression whose group is the carrier
(GHz) in the file's name, where `carrier_hz` serves files without one; and `device`, the radar that
recorded them where another set has it too. Another folder becomes a set by its file `set.yaml`:
`like`, a set of the same radar, and `files`, its records.
"""

import re
import sys
from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.classes import CATEGORIES
from lowalt.extensions.recordings.faults import RATE_SHARE
from lowalt.extensions.recordings.files import Baseband, read
from lowalt.extensions.recordings.formats import READERS
from lowalt.extensions.recordings.presence import present
from lowalt.extensions.recordings.record import Record, read_record, record
from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.extensions.recordings.windows import windows
from lowalt.files.atomic import sha256
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml

HALVES = ("tuning", "test")
SET_FILE = "set.yaml"
"""Name of the file that makes a folder a set."""
SETS, SPLIT = (Path(__file__).parent / f"measured/{name}.yaml" for name in ("sets", "split"))


class Measured(NamedTuple):
    """One recording of a set: `half` is "tuning" or "test", `like` the known set of the same radar,
    `radar` the name of that radar's record.

    rates_hz: possible rates (Hz), of which the file has one; none where its record alone says it.
    of: the radar that recorded it, where another set has it too.
    """

    set: str
    half: str
    record: Record
    like: str
    radar: str
    rates_hz: tuple[float, ...] = ()
    of: str = ""

    @property
    def device(self) -> str:
        """The radar that recorded it: one set is of one radar."""
        return self.of or self.set

    @property
    def name(self) -> str:
        """File name, which is unique in a set."""
        return self.record.file.name

    def twin(self, library: Library) -> Twin:
        """Return the twin of this recording's radar, at the recording's carrier.

        Raises: InputError where no radar of the library has this set.
        """
        if self.radar not in library.twins:
            raise InputError(
                f"set {self.set!r}: no radar {self.radar!r}, expected one of"
                f" {sorted(library.twins)}"
            )
        return library.twins[self.radar].at_carrier(self.record.carrier_hz)

    def read(self) -> Baseband:
        """Return the recording's samples, at the one of its possible rates that the file has.

        Raises: InputError as `lowalt.extensions.recordings.read`, and where the file has none of
        the rates.
        """
        baseband = read(self.record)
        if not self.rates_hz:
            return baseband
        nearest = min(self.rates_hz, key=lambda rate_hz: abs(rate_hz - baseband.rate_hz))
        if abs(nearest - baseband.rate_hz) > RATE_SHARE * nearest:
            raise InputError(
                f"{self.record.file}: wrong rate, {baseband.rate_hz:.6g} Hz, expected one of"
                f" {self.rates_hz}"
            )
        return baseband._replace(rate_hz=nearest)

    def windows(self, twin: Twin) -> np.ndarray:
        """Return the recording's windows that hold a target, (n, symbols) complex128 at the twin's
        symbol rate.

        Raises: InputError as `read`, and where the recording is shorter than one window.
        """
        every = windows(self.record, twin, self.read())
        return every[present(every, twin)]


def halves(path: str | Path = SPLIT) -> dict[str, dict[str, list[str]]]:
    """Return set -> half -> file names.

    Raises: InputError where a set lacks a half, or names a file twice.
    """
    split = load_yaml(path, "split of the recordings", "sets to their halves")
    for name, block in split.items():
        if not isinstance(block, dict) or set(block) != set(HALVES):
            raise InputError(f"{path}: {name} is {block!r:.80}, expected exactly {HALVES}")
        both = [file for half in HALVES for file in block[half]]
        twice = sorted({file for file in both if both.count(file) > 1})
        if twice:
            raise InputError(f"{path}: {name} names {twice} twice, expected every file in one half")
    return split


class _File(NamedTuple):
    """The record of one file of a set, its possible rates and the radar that the set names."""

    record: Record
    rates_hz: tuple[float, ...] = ()
    device: str = ""


def _of_pattern(block: dict, path: Path, where: str) -> _File:
    """The file of a set's pattern, its carrier read from its name where the set says so."""
    of_sets = ("radar", "carrier_ghz_in_name", "rates_hz", "device")
    keys = {key: item for key, item in block.items() if key not in of_sets}
    carrier = re.search(block.get("carrier_ghz_in_name", "(?!)"), path.name)
    if carrier:
        keys["carrier_hz"] = float(carrier[1]) * 1e9
    described = replace(record(keys, path.parent, where), file=path)
    return _File(described, tuple(map(float, block.get("rates_hz", ()))), block.get("device", ""))


def _files(folder: Path, patterns: list[dict], where: str) -> dict[str, _File]:
    """The files of a set's folder by name; files that no record describes are named on standard
    error.
    """
    files: dict[str, _File] = {}
    for number, block in enumerate(patterns):
        for path in sorted(folder.glob("*")):
            if not fnmatch(path.name.lower(), block["file"].lower()):
                continue
            if path.name in files:
                raise InputError(f"{where}: {path.name} fits two patterns, expected one")
            files[path.name] = _of_pattern(block, path, f"{where}[{number}]")
    for path in sorted(folder.glob("*.yaml")):
        if path.name != SET_FILE:
            beside = read_record(path)
            if beside.label is None:
                raise InputError(f"{path}: no label, expected one of {CATEGORIES}")
            files[beside.file.name] = _File(beside)
    for path in sorted(folder.glob("*")):
        if path.suffix.lower() in READERS and path.name not in files:
            print(f"{path}: left out, no pattern of its set and no record fits", file=sys.stderr)
    return files


def _blocks(inputs: Path, sets: str | Path) -> dict[str, tuple[str, list[dict]]]:
    """Set -> (known set of the same radar, records): the known sets and the folders that have a
    file of their own.
    """
    known = load_yaml(sets, "measured sets", "sets to their records")
    blocks = {name: (name, patterns) for name, patterns in known.items()}
    for folder in sorted(
        path for path in inputs.glob("*") if path.is_dir() and path.name not in known
    ):
        if not (folder / SET_FILE).is_file():
            print(
                f"{folder}: left out, no set of that name and no {SET_FILE} in it", file=sys.stderr
            )
            continue
        block = load_yaml(folder / SET_FILE, "set of recordings", "like and files")
        if (
            set(block) != {"like", "files"}
            or block["like"] not in known
            or not isinstance(block["files"], list)
        ):
            raise InputError(
                f"{folder / SET_FILE}: expected files, a list of records, and like, one of"
                f" {sorted(known)}"
            )
        blocks[folder.name] = block["like"], block["files"]
    return blocks


def recordings(
    inputs: str | Path, sets: str | Path = SETS, split: str | Path = SPLIT
) -> list[Measured]:
    """Return the recordings there are below the folder `inputs`, one folder a set, in the order of
    sets and names.

    A set whose folder is missing is left out. Raises: InputError where no recording is there, a
    record is wrong, or a file fits two patterns of its set.
    """
    blocks = _blocks(Path(inputs), sets)
    half_of = halves(split)
    result = []
    radars = {
        name: patterns[0]["radar"] for name, (like, patterns) in blocks.items() if like == name
    }
    for name, (like, patterns) in blocks.items():
        where = f"{sets}: {name}" if like == name else str(Path(inputs) / name / SET_FILE)
        tuning = half_of.get(name, {}).get("tuning", ())
        for file, found in sorted(_files(Path(inputs) / name, patterns, where).items()):
            half = "tuning" if file in tuning else "test"
            result.append(
                Measured(name, half, found.record, like, radars[like], found.rates_hz, found.device)
            )
    if not result:
        raise InputError(f"{inputs}: no recordings of {sorted(blocks)}, expected a folder a set")
    return result


def usable(measured: list[Measured], library: Library) -> list[Measured]:
    """Return the recordings that can be read and cut into windows; the others are named on standard
    error.

    A recording counts once, whatever its file's name: of files with equal bytes the first is taken,
    tuning before test.
    Raises: InputError where none can be used.
    """
    good = []
    known = {}
    for recording in sorted(measured, key=lambda one: HALVES.index(one.half)):
        try:
            digest = sha256(recording.record.file)
            if digest in known:
                raise InputError(f"{recording.record.file}: the same bytes as {known[digest]}")
            recording.windows(recording.twin(library))
            good.append(recording)
            known[digest] = recording.record.file
        except InputError as error:
            print(f"left out: {error}", file=sys.stderr)
    if not good:
        raise InputError(f"none of {len(measured)} recordings can be used, expected at least one")
    return [recording for recording in measured if recording in good]
