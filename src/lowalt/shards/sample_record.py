"""The bytes of a sample: its rank in the shuffled order, its JSON record, its signals as .npy.

Every field has one type in all records, and no value is missing, so that tables with typed columns
(Arrow) hold them.
"""

import json
import math
from collections.abc import Sequence

import numpy as np

from lowalt.config.classes import CATEGORIES, label
from lowalt.config.network import Network, Station
from lowalt.files.errors import InputError
from lowalt.motion.table import TRACK
from lowalt.numerics.portable import dot, norm
from lowalt.numerics.streams import digest
from lowalt.scene.effects import NamedEffect, record_fields
from lowalt.shards.sample_list import sample_key
from lowalt.tiles.tile_files import npy_header

NAMES = ("subtype", "category", "group", "model")
OWN = (
    *("key", "label", "fold", "snr_db", "noise", "seed"),
    *("motion", "geometry", "cube", "versions", "power_w"),
)
"""Further fields of a record, which no effect may add."""
ADDED = "added"
"""Key of a row for the fields that effects add to the record."""
DATA_VERSION = "0.2.0"
"""Version of the rules by which a configuration becomes bytes. A change of the default's bytes
changes the rules.

It is not the version of the package: a release that changes no rule makes the same shards as the
release before it.
"""


def rank(seed: int, subtype: str, model: int, snr_db: float) -> bytes:
    """Return the digest that orders a shard's samples: a shuffle by each sample's name alone."""
    level = "inf" if math.isinf(snr_db) else float(snr_db)
    return digest(seed, "order", subtype, model, level)


def encoded(content: dict) -> bytes:
    """Return a record as JSON; an SNR of infinity is written as 1e999.

    This is a number by JSON's grammar, and readers take it as infinity. Raises: ValueError for any
    other number that is not finite.
    """

    def number(snr: float) -> str:
        """One SNR as a number of JSON."""
        if snr == math.inf:
            return "1e999"
        return json.dumps(snr, allow_nan=False)

    fields = []
    for name, value in content.items():
        if name != "snr_db":
            text = json.dumps(value, separators=(",", ":"), allow_nan=False)
        elif isinstance(value, list):
            text = f"[{','.join(map(number, value))}]"
        else:
            text = number(value)
        fields.append(f'"{name}":{text}')
    return ("{" + ",".join(fields) + "}").encode()


def geometry(row: dict, network: Network) -> dict[str, dict[str, float]]:
    """Return range, direction and speed of the target from each station at the first symbol.

    They are those of its reference point: range_m; psi and omega, the direction cosines along the
    array's horizontal and vertical axis; radial_mps, positive receding; NaN where the row has no
    position, as a measured target's. A link has the means of both stations' ranges and speeds, and
    the cosines of its receiver. Source: paper, Eq. 4, written with direction cosines.
    """
    result = {}
    for station in network.stations:
        seen = _seen(row, station)
        if station.transmitter is not None:
            sent = _seen(row, station.transmitter)
            for name in ("range_m", "radial_mps"):
                seen[name] = 0.5 * (seen[name] + sent[name])
        result[station.name] = seen
    return result


def _seen(row: dict, station: Station) -> dict[str, float]:
    """Range, direction and speed of the target's reference point, seen by one station's array."""
    offset = np.array([row["x_m"], row["y_m"], row["z_m"]]) - np.array(station.position_m)
    distance = float(norm(offset))
    towards = np.zeros(3)
    if distance != 0:
        towards = offset / distance
    speed = np.array([row["vx_mps"], row["vy_mps"], row["vz_mps"]])
    return {
        "range_m": distance,
        "psi": float(dot(towards, station.horizontal)),
        "omega": float(towards[2]),
        "radial_mps": float(dot(towards, speed)),
    }


def record(
    row: dict,
    snr_db: float,
    fold: str,
    seed: int,
    network: Network,
    classes: tuple[str, ...] = CATEGORIES,
    cubes: dict | None = None,
) -> bytes:
    """Return the JSON record of one sample: name, class, motion, geometry, seed and versions.

    row: a row of the motion table; a number that does not apply to the target is NaN there and 0
    here. `noise` says whether noise was added; where none was, `snr_db` is infinite. Numbers that
    are unknown are null, as for a recorded target whose position was not recorded. Where `row` has
    the key ADDED, what the scene's effects say of the sample (`accompanied`), the record has its
    fields too; the label is the row's own target's. A row of a track adds its track and look.
    classes: in the order of their labels; cubes: facts on each station's cube.
    Raises: InputError where the row's category is no class, or an effect gives a field that the
    record has already.
    """
    names = NAMES + TRACK * (TRACK[0] in row)
    motion = {name: value for name, value in row.items() if name not in (*names, "fold", ADDED)}
    added = row.get(ADDED, {})
    taken = sorted({*OWN, *names} & set(added))
    if taken:
        raise InputError(f"effects: one adds {taken} to records, expected other names of fields")
    unknown_position = math.isnan(row["x_m"])
    content = {
        "key": sample_key(row["subtype"], row["model"], snr_db),
        "label": label(classes, row),
        **{name: row[name] for name in names},
        **added,
        "fold": fold,
        "snr_db": float(snr_db),
        "noise": not math.isinf(snr_db),
        "seed": seed,
        "motion": _without_nan(motion, None if unknown_position else 0.0),
        "geometry": {},
    }
    for station, seen in geometry(row, network).items():
        content["geometry"][station] = _without_nan(seen, None)
    if cubes:
        content["cube"] = cubes
    content["versions"] = {"lowalt": DATA_VERSION}
    return encoded(content)


def _without_nan(numbers: dict[str, float], blank: float | None) -> dict[str, float | None]:
    """The numbers by name, with `blank` in place of NaN."""
    result: dict[str, float | None] = {}
    for name, value in numbers.items():
        result[name] = blank if math.isnan(value) else float(value)
    return result


def accompanied(row: dict, effects: Sequence[NamedEffect], seed: int, network: Network) -> dict:
    """Return the row with what effects, if there are any, say of its sample at the key ADDED."""
    if not effects:
        return row
    return {**row, ADDED: record_fields(effects, network, seed, row)}


def row_of(entry: dict) -> tuple[dict, float]:
    """Return the row of the motion table and the SNR (dB) that a record holds.

    The row has 0 where a number does not apply. Raises: InputError naming the sample where the
    record is of an older format.
    """
    if "noise" not in entry:
        made_by = entry.get("versions", {}).get("lowalt", "an unknown version")
        raise InputError(
            f"sample {entry.get('key')}: record of lowalt {made_by}, expected of 0.2 or later"
        )
    names = NAMES + TRACK * (TRACK[0] in entry)
    snr_db = entry["snr_db"] if entry["noise"] else math.inf
    return {**{name: entry[name] for name in names}, **entry["motion"]}, snr_db


def npy(signals: np.ndarray) -> bytes:
    """Return signals (stations, symbols) complex64 as an .npy file of float32 (..., 2).

    The last axis is real and imaginary part: Arrow, which many readers use, has no complex numbers.
    """
    pairs = real_and_imaginary(signals)
    return npy_header("<f4", pairs.shape) + pairs.tobytes()


def real_and_imaginary(values: np.ndarray) -> np.ndarray:
    """Return complex64 values (...) as float32 (..., 2), in the byte order of files."""
    return np.ascontiguousarray(values, "<c8").view("<f4").reshape(*values.shape, 2)
