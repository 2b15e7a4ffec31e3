"""The bytes of a sample: its place in the shuffled order, its JSON record, its signals as an .npy
file.

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
    return digest(seed, "order", subtype, model, "inf" if math.isinf(snr_db) else float(snr_db))


def encoded(content: dict) -> bytes:
    """Return a record as JSON; an SNR of infinity is 1e999, a number by JSON's grammar that readers
    take as infinity.

    Raises: ValueError for any other number that is not finite.
    """

    def number(snr: float) -> str:
        """One SNR as a number of JSON."""
        return "1e999" if snr == math.inf else json.dumps(snr, allow_nan=False)

    snr_db = content["snr_db"]
    texts = {
        name: json.dumps(value, separators=(",", ":"), allow_nan=False)
        for name, value in content.items()
        if name != "snr_db"
    }
    texts["snr_db"] = (
        f"[{','.join(map(number, snr_db))}]" if isinstance(snr_db, list) else number(snr_db)
    )
    return ("{" + ",".join(f'"{name}":{texts[name]}' for name in content) + "}").encode()


def geometry(row: dict, network: Network) -> dict[str, dict[str, float]]:
    """Return range, direction and speed of the target's reference point from each station at the
    first symbol.

    range_m; psi and omega, the direction cosines along the array's horizontal and vertical axis;
    radial_mps, positive receding; NaN where the row has no place, as a measured target's. A link
    has the means of both stations' ranges and speeds, and the cosines of its receiver. Source:
    paper, Eq. 4, written with direction cosines.
    """
    result = {}
    for station in network.stations:
        seen = _seen(row, station)
        if station.transmitter is not None:
            sent = _seen(row, station.transmitter)
            seen |= {name: 0.5 * (seen[name] + sent[name]) for name in ("range_m", "radial_mps")}
        result[station.name] = seen
    return result


def _seen(row: dict, station: Station) -> dict[str, float]:
    """Range, direction and speed of the target's reference point, seen by one station's array."""
    offset = np.array([row["x_m"], row["y_m"], row["z_m"]]) - np.array(station.position_m)
    distance = float(norm(offset))
    towards = offset / distance if distance != 0 else np.zeros(3)
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
    """Return the JSON record of one sample: name, class, motion, geometry for each station, seed
    and versions.

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
    if taken := sorted({*OWN, *names} & set(added)):
        raise InputError(f"effects: one adds {taken} to records, expected other names of fields")
    blank = None if math.isnan(row["x_m"]) else 0.0
    content = {
        "key": sample_key(row["subtype"], row["model"], snr_db),
        "label": label(classes, row),
        **{name: row[name] for name in names},
        **added,
        "fold": fold,
        "snr_db": float(snr_db),
        "noise": not math.isinf(snr_db),
        "seed": seed,
        "motion": {
            name: blank if math.isnan(value) else float(value) for name, value in motion.items()
        },
        "geometry": {
            station: {name: None if math.isnan(value) else value for name, value in seen.items()}
            for station, seen in geometry(row, network).items()
        },
        **({"cube": cubes} if cubes else {}),
        "versions": {"lowalt": DATA_VERSION},
    }
    return encoded(content)


def accompanied(row: dict, effects: Sequence[NamedEffect], seed: int, network: Network) -> dict:
    """Return the row with what effects say of its sample at the key ADDED; the row alone without
    effects.
    """
    return {**row, ADDED: record_fields(effects, network, seed, row)} if effects else row


def row_of(entry: dict) -> tuple[dict, float]:
    """Return the motion table's row (0 where a number does not apply) and the SNR (dB) that a
    record holds.

    Raises: InputError naming the sample where the record is of an older format.
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
    """Return signals (stations, symbols) complex64 as the bytes of an .npy file of float32
    (stations, symbols, 2).

    The last axis is real and imaginary part: Arrow, which many readers use, has no complex numbers.
    """
    parts = parts_of(signals)
    return npy_header("<f4", parts.shape) + parts.tobytes()


def parts_of(values: np.ndarray) -> np.ndarray:
    """Return complex64 values (...) as float32 (..., 2), real and imaginary part, in the byte order
    of files.
    """
    return np.ascontiguousarray(values, "<c8").view("<f4").reshape(*values.shape, 2)
