"""A recording of unknown layout: every reading that fits, with its strongest line, and what is
wrong with the best.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings import faults
from lowalt.extensions.recordings.chirps import slow_time
from lowalt.extensions.recordings.column_names import rises_evenly, role
from lowalt.extensions.recordings.evidence import (
    are_powers,
    begins_anew,
    chirp_length,
    code_bits,
    image_of,
    receivers_of,
    step_bits,
)
from lowalt.extensions.recordings.files import channel_of, table_of, times_of
from lowalt.extensions.recordings.formats import MOST_RECORDING_BYTES, RAW, Table, refuse_kind
from lowalt.extensions.recordings.layouts import raw_readings, readings
from lowalt.extensions.recordings.mat_files import read_mat
from lowalt.extensions.recordings.record import Record
from lowalt.files.array_files import UNREADABLE, array_of
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError, reading

SHOWN = 8
"""Most readings that an inspection lists."""
MOST_COLUMNS = 16
"""Most columns of a text table that are channels; rows of more hold a chirp each."""
FEWEST_SAMPLES = 16
"""Least number of samples that can be a signal."""
SLOW_SHARE = 5e-4
LONGEST = 1 << 20
"""Number of samples, from the start, from which spectra are computed."""
RATE_NAMES = ("fs", "rate", "sample_rate", "samplerate", "sampling_rate", "prf")
MAINS_HZ = (50.0, 60.0)
HUM_DB = 10.0
HARMONICS = 10
"""How far a line of the mains stands above its surroundings, and up to which harmonic it is looked
for.
"""
DC_DB = 20.0
IMAGE_DB = -10.0
COHERENT = 0.5
"""Least squared coherence with which a line has an image, rather than noise at the opposite
Doppler.
"""


class Candidate(NamedTuple):
    """A reading of a file: the keys of a record that give it, its code length in bits per byte
    (fewer fit better), and whether the file's header or names state it."""

    keys: dict
    bits: float
    said: bool = False


class Seen(NamedTuple):
    """A reading with its samples: values (n,) at `rate_hz`, and the frequency of the strongest line
    (Hz).
    """

    keys: dict
    bits: float
    said: bool
    values: np.ndarray
    rate_hz: float
    line_hz: float


@dataclass(frozen=True)
class FileInspection:
    """What is seen in a file: carrier and rate (Hz, None where unknown), readings, and faults of
    the first reading.

    said: which of carrier_hz and rate_hz the file or the user states.
    """

    path: Path
    carrier_hz: float | None
    rate_hz: float | None
    said: tuple[str, ...]
    readings: list[Seen]
    notes: list[str]

    def speed_mps(self, seen: Seen) -> float:
        """Radial speed of a reading's strongest line (m/s), NaN where no carrier is known."""
        return seen.line_hz * SPEED_OF_LIGHT / 2 / self.carrier_hz if self.carrier_hz else math.nan


def _of_columns(table: Table) -> list[Candidate]:
    """Readings of a table of a few columns: pairs as I and Q, each alone as a real channel."""
    names: tuple[str | int, ...] = table.names or tuple(range(len(table.columns)))
    roles = dict(zip(names, [role(str(name)) for name in names], strict=True))
    kept = [
        (name, column)
        for name, column in zip(names, table.columns, strict=True)
        if roles[name] != "time" and not (len(names) > 1 and rises_evenly(column))
    ]
    alone = len(kept) == len(names) == 1
    step = step_bits(np.concatenate([column[:4096] for _, column in kept])) if kept else 0.0
    if alone and not np.iscomplexobj(kept[0][1]):
        found = readings(np.asarray(kept[0][1]))
        return [Candidate(_channel_keys(one.layout), one.bits) for one in found]
    result = []
    bits = {name: code_bits([column], step) for name, column in kept}
    mean = float(np.mean(list(bits.values()))) if bits else 0.0
    for place, (name, column) in enumerate(kept):
        where = {} if alone else {"columns": [name]}
        if np.iscomplexobj(column):
            result.append(Candidate({"channel": "complex", **where}, bits[name]))
            continue
        # Pairs stand next to each other, or all in-phase columns before all quadrature columns.
        half = len(kept) // 2
        partners = {place + 1, place + half} if len(kept) % 2 == 0 and place < half else {place + 1}
        for other, values in (kept[partner] for partner in sorted(partners) if partner < len(kept)):
            if np.iscomplexobj(values):
                continue
            pair = {"i": 0, "q": 1, "magnitude": 2, "phase": 3}
            said = {roles[name], roles[other]} in ({"i", "q"}, {"magnitude", "phase"})
            order = (
                sorted((name, other), key=lambda one: pair.get(roles[one], 4))
                if said
                else [name, other]
            )
            keys = {"channel": "complex", "columns": order}
            if roles[order[0]] == "magnitude" and said:
                keys["layout"] = "polar"
            together = code_bits([column[: len(values)].astype(float) + 1j * values], step)
            gain = 2 / len(kept) * (together - 0.5 * (bits[name] + bits[other]))
            result.append(Candidate(keys, mean + gain - 1e-3, said))
        result.append(Candidate({"channel": "real", **where}, mean))
    return result


def _channel_keys(layout: str) -> dict:
    """Keys of a record for a layout; "" is one real channel."""
    return {"channel": "complex", "layout": layout} if layout else {"channel": "real"}


def _of_chirps(array: np.ndarray) -> list[Candidate]:
    """Readings of an array with two or more long axes, one of which has the samples of a chirp."""
    result = []
    for samples, stream in ((array.shape[-1], array), (array.shape[0], array.T)):
        length, strength = chirp_length(np.ascontiguousarray(stream).reshape(-1))
        chirps = {"samples": samples}
        if array.ndim > 2 and samples == array.shape[-1] and 1 < array.shape[-2] <= 16:
            chirps["receivers"] = array.shape[-2]
        keys = {"channel": "complex", "chirps": chirps}
        result.append(Candidate(keys, 8.0 - strength * (length == samples)))
    return result


def _of_rows(path: Path, table: Table) -> tuple[list[Candidate], float | None, float | None]:
    """Readings of a text matrix with a chirp a row, one real channel or I and Q, and perhaps a last
    column of times.
    """
    last = np.asarray(table.columns[-1], float)
    timed = bool((np.diff(last) > 0).all())
    samples = len(table.columns) - timed
    rate = faults.agreed_rate(path, None, None, last) if timed else None
    stream = np.stack(table.columns[:samples], axis=1).reshape(-1)
    lengths = [samples]
    if samples % 2 == 0:
        lengths.append(samples // 2)
        if begins_anew(stream.reshape(-1, samples), samples // 2):
            lengths.reverse()
    return (
        [
            Candidate({"channel": "complex", "chirps": {"samples": length}}, 8.0 + place)
            for place, length in enumerate(lengths)
        ],
        rate,
        None,
    )


def _of_raw(path: Path) -> list[Candidate]:
    """Readings of a file without a header; `said` marks the one that its ending stands for."""
    own = RAW[path.suffix.lower()]
    result = []
    for one in raw_readings(str(path))[: 2 * SHOWN]:
        said = (one.dtype, one.layout) == (
            ("float32", "iqiq") if own[:1] == ("complex64",) else own
        )
        keys = _channel_keys(one.layout) if not said else {"channel": "complex"}
        result.append(Candidate(keys if said else {**keys, "dtype": one.dtype}, one.bits, said))
    return result


def _arrays(path: Path) -> tuple[list[tuple[dict, np.ndarray]], float | None]:
    """Arrays of a NumPy, MATLAB or HDF5 file, each with the keys that name it, and a rate (Hz) that
    a variable says.
    """
    if path.suffix.lower() == ".npy":
        return [({}, array_of(path, "recording"))], None
    variables = read_mat(path)
    rate = next(
        (
            float(np.ravel(value)[0].real)
            for name, value in variables.items()
            if value.size == 1 and name.lower().rpartition(".")[2] in RATE_NAMES
        ),
        None,
    )
    arrays = {name: value for name, value in variables.items() if value.size > 64}
    return [
        ({"variable": name} if len(arrays) > 1 else {}, value) for name, value in arrays.items()
    ], rate


def _table(path: Path, carrier_hz: float | None) -> tuple[Table, dict]:
    """The table of a file that states its columns, and further keys of its record: `capture: 0` for
    a SigMF file whose captures do not follow on one another at one carrier."""
    record = _record(path, {"channel": "complex"}, carrier_hz, None)
    try:
        table = table_of(record)
        carrier = table.carrier_hz if carrier_hz is None else None
        return (table if carrier is None else table_of(replace(record, carrier_hz=carrier))), {}
    except InputError:
        if not path.suffix.lower().startswith(".sigmf"):
            raise
        return table_of(replace(record, capture=0)), {"capture": 0}


def _candidates(
    path: Path, carrier_hz: float | None
) -> tuple[list[Candidate], float | None, float | None]:
    """Readings of a file, and the rate and carrier (Hz) that it states; carrier_hz: what the user
    states.
    """
    kind = path.suffix.lower()
    rate = None
    carrier = None
    result = []
    if kind in RAW:
        return _of_raw(path), None, None
    if kind in (".npy", ".mat", ".h5", ".hdf5"):
        arrays, rate = _arrays(path)
        for keys, array in arrays:
            array = np.squeeze(array)
            if array.dtype.kind not in "iufc" or array.size < 64:
                continue
            long = sum(length >= 16 for length in array.shape)
            columns = (
                array.reshape(len(array), -1) if array.shape[0] >= array.shape[-1] else array.T
            )
            if long < 2 and columns.shape[1] > MOST_COLUMNS:
                continue
            found = _of_chirps(array) if long >= 2 else _of_columns(Table(list(columns.T)))
            result += [one._replace(keys={**keys, **one.keys}) for one in found]
    else:
        table, keys = _table(path, carrier_hz)
        if len(table.columns[0]) < FEWEST_SAMPLES:
            return [], None, None
        times = times_of(table, _record(path, {"channel": "complex"}, math.nan, None))
        carrier = table.carrier_hz
        rate = table.rate_hz
        if len(table.columns) > MOST_COLUMNS:
            return _of_rows(path, table)
        if rate is None and times is not None:
            rate = faults.agreed_rate(path, None, None, times)
        result = [one._replace(keys={**one.keys, **keys}) for one in _of_columns(table)]
        if kind == ".wav" and len(table.columns) == 1:
            # A WAV file states its channels.
            result = [one._replace(said=one.keys["channel"] == "real") for one in result]
    return result, rate, carrier


def _record(path: Path, keys: dict, carrier_hz: float | None, rate_hz: float | None) -> Record:
    """A record of a reading."""
    hertz = math.nan if carrier_hz is None else carrier_hz
    keys = {key: tuple(value) if key == "columns" else value for key, value in keys.items()}
    return Record(file=path, carrier_hz=hertz, rate_hz=rate_hz, **keys)


def _line(values: np.ndarray, rate_hz: float) -> float:
    """Frequency (Hz) of the strongest line of samples (n,), its sign lost where they are real.

    Slow noise, which rises towards zero, is no line: what is below `SLOW_SHARE` of the rate does
    not count.
    """
    part = values[:LONGEST]
    power = np.abs(np.fft.fft((part - part.mean()) * np.hanning(len(part)))) ** 2
    slow = max(2, round(SLOW_SHARE * len(part)))
    power[:slow] = power[1 - slow :] = 0
    if np.isrealobj(values):
        power[len(power) // 2 + 1 :] = 0
    return float(np.fft.fftfreq(len(power), 1 / rate_hz)[power.argmax()])


def _seen(path: Path, one: Candidate, rate_hz: float, values: np.ndarray | None = None) -> Seen:
    """A reading with its samples. Raises: InputError or another error of a reader where the file
    does not fit it.
    """
    if values is None:
        record = _record(path, {**one.keys, "trust": "record"}, None, rate_hz)
        values = channel_of(table_of(record), record)
    chirps = one.keys.get("chirps")
    if chirps:
        receivers = chirps.get("receivers", 1)
        whole = chirps["samples"] * receivers
        values = slow_time(values[: len(values) // whole * whole], chirps["samples"], receivers)
    if not np.isfinite(values).all() or len(values) < FEWEST_SAMPLES or np.ptp(np.abs(values)) == 0:
        raise InputError(f"{path}: no signal under {one.keys}")
    return Seen(*one, values, rate_hz, _line(values, rate_hz))


def inspect_recording(
    path: str | Path, carrier_hz: float | None = None, rate_hz: float | None = None
) -> FileInspection:
    """Return what a recording's file shows: its readings, the best first, and the faults of the
    best.

    carrier_hz, rate_hz: as the user knows them (the rate of chirps is their number per second);
    None takes what the file states. Raises: InputError where the file is missing, of an unknown
    kind, or nothing in it reads as a signal.
    """
    path = existing(path, "recording", MOST_RECORDING_BYTES)
    refuse_kind(path)
    with reading(path, f"{path.suffix} file"):
        return _inspected(path, carrier_hz, rate_hz)


def _inspected(path: Path, carrier_hz: float | None, rate_hz: float | None) -> FileInspection:
    """What the file shows; a damaged one may raise any exception."""
    candidates, own_rate, own_carrier = _candidates(path, carrier_hz)
    said = tuple(
        name
        for name, given, own in (
            ("carrier_hz", carrier_hz, own_carrier),
            ("rate_hz", rate_hz, own_rate),
        )
        if given is not None or own is not None
    )
    contradicted = rate_hz and own_rate and abs(rate_hz / own_rate - 1) > faults.RATE_SHARE
    if contradicted:
        # Without this key the record of the user's rate is refused.
        candidates = [one._replace(keys={**one.keys, "trust": "record"}) for one in candidates]
    carrier_hz = carrier_hz or own_carrier
    rate_hz = rate_hz or own_rate
    found = []
    for one in sorted(candidates, key=lambda one: (not one.said, one.bits))[: 2 * SHOWN]:
        try:
            found.append(_seen(path, one, rate_hz or 1.0))
        except (InputError, *UNREADABLE):
            continue
        if len(found) == 1 and "chirps" not in one.keys:
            chirped = _in_chirps(path, one, found[0], rate_hz or 1.0)
            found = [*found, *chirped] if one.said else [*chirped, *found]
    if not found:
        raise InputError(
            f"{path}: nothing in it reads as a signal, expected samples of one or two channels"
        )
    notes = _notes(path, found[0], rate_hz, carrier_hz)
    if contradicted:
        notes.insert(
            0,
            f"the file states a rate of {own_rate:.6g} Hz: with `trust: record` the stated "
            f"{rate_hz:.6g} Hz holds",
        )
    powers = next(
        (
            one
            for one in found
            if are_powers(one.values) and "float" in one.keys.get("dtype", "float")
        ),
        None,
    )
    if powers is not None:
        kind = f"read as {powers.keys['dtype']} " if "dtype" in powers.keys else ""
        notes.insert(
            0,
            f"{kind}no number is negative and most are far below their mean, as powers or"
            " magnitudes of spectra are: a recording needs the samples themselves",
        )
    return FileInspection(path, carrier_hz, rate_hz, said, found[:SHOWN], notes)


def _in_chirps(path: Path, one: Candidate, seen: Seen, rate_hz: float) -> list[Seen]:
    """The reading of a stream as chirps, where its innovations repeat."""
    samples, strength = chirp_length(seen.values)
    if not samples or len(seen.values) < 16 * samples:
        return []
    chirps = {"samples": samples, "receivers": receivers_of(seen.values, samples)}
    keys = {**one.keys, "channel": "complex", "chirps": chirps}
    whole = len(seen.values) // (samples * chirps["receivers"]) * samples * chirps["receivers"]
    try:
        return [_seen(path, Candidate(keys, one.bits - strength), rate_hz, seen.values[:whole])]
    except InputError:
        # A signal that repeats exactly stands still from chirp to chirp.
        return []


def _decibels(ratio: float) -> float:
    """A ratio of powers in decibels."""
    return 10 * math.log10(max(ratio, 1e-30))


def _notes(path: Path, seen: Seen, rate_hz: float | None, carrier_hz: float | None) -> list[str]:
    """Sentences on faults of a reading: clipping, a constant part, hum of the mains, a mirrored
    sign, refusals.
    """
    values = seen.values[:LONGEST]
    notes = []
    if "capture" in seen.keys:
        notes.append(
            "its captures do not follow on one another at one carrier: the record takes the first, "
            "`capture: "
            "1` the next"
        )
    spread = values.std()
    mean = values.mean()
    gone = faults.lost(values).mean()
    if gone:
        notes.append(
            f"{100 * gone:.2g} % of the samples are lost: exact zeros in a row; their windows are"
            " left out"
        )
    constant = _decibels(abs(mean) ** 2 / spread**2)
    if constant > DC_DB:
        notes.append(
            f"a constant part stands {constant:.0f} dB above the rest: the transmitter's leak, or"
            " unsigned numbers; each window loses its mean anyway"
        )
    power = np.abs(np.fft.fft((values - mean) * np.hanning(len(values)))) ** 2
    if rate_hz:
        notes += _hum(power, seen.rate_hz)
    if np.iscomplexobj(values):
        image, coherence = image_of(values, seen.line_hz / seen.rate_hz)
        if _decibels(image) > IMAGE_DB and coherence > COHERENT:
            below = max(0.0, -_decibels(image))
            notes.append(
                f"the strongest line has an image at the opposite Doppler, {below:.0f} dB below: a"
                " target with equal sides, such as a rotor, or I and Q of unequal strength"
            )
        elif "chirps" not in seen.keys and (
            len(seen.keys.get("columns", ())) == 2 or seen.keys.get("layout")
        ):
            notes.append(
                "the sign holds if I comes before Q: exchanged, every speed changes its sign; "
                "`moves` in the "
                "record checks it"
            )
    try:
        faults.check(path, seen.values)
    except InputError as error:
        notes.append(str(error).removeprefix(f"{path}: "))
    return notes


def _hum(power: np.ndarray, rate_hz: float) -> list[str]:
    """A sentence on lines of the mains in a power spectrum (n,), Hann window, of samples at
    `rate_hz`.
    """
    step = rate_hz / len(power)
    for mains in MAINS_HZ:
        lines = []
        for number in range(1, HARMONICS + 1):
            place = round(number * mains / step)
            wide = max(4, round(6 / step))
            if place + wide >= len(power) // 2 or place <= wide or step > 2:
                break
            around = np.r_[power[place - wide : place - 3], power[place + 4 : place + wide + 1]]
            floor = float(np.median(around)) if len(around) else math.inf
            if _decibels(power[place - 1 : place + 2].max() / max(floor, 1e-300)) > HUM_DB + 10:
                lines.append(number * mains)
        if len(lines) >= 2:
            return [
                f"hum of the mains: narrow lines at {', '.join(f'{line:g}' for line in lines)} Hz"
            ]
    return []
