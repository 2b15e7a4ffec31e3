"""What a sample says about itself: its key, its place in the shuffled order, its JSON record."""

import functools
import importlib.metadata
import json
import math

import numpy as np

from lowalt import __version__
from lowalt.common.files import slug
from lowalt.common.network import Network
from lowalt.common.streams import digest
from lowalt.targets.cloud import CATEGORIES


def snr_label(snr_db: float) -> str:
    """Return an SNR for a key: `snrinf`, `snr003`, `snr-60`, `snr003p5` (no dots, which end a key in a tar)."""
    if math.isinf(snr_db):
        return "snrinf"
    text = f"{int(snr_db):03d}" if float(snr_db).is_integer() else f"{snr_db:05.1f}"
    if float(text) != snr_db:
        text = repr(float(snr_db))
    return "snr" + text.replace(".", "p")


def sample_key(subtype: str, model: int, snr_db: float) -> str:
    """Return the key of a sample, {slug}-{model, six digits}-{SNR}: unique, no dots, sorts by subtype and model."""
    return f"{slug(subtype)}-{model:06d}-{snr_label(snr_db)}"


def rank(seed: int, subtype: str, model: int, snr_db: float) -> bytes:
    """Return the digest that orders the samples of a shard: a shuffle that depends on each sample's name alone."""
    return digest(seed, "order", subtype, model, "inf" if math.isinf(snr_db) else float(snr_db))


@functools.cache
def versions() -> dict[str, str]:
    """Versions of what decides a sample's bytes."""
    names = ("numpy", "numba", "deflate", "matplotlib")
    return {"lowalt": __version__, **{name: importlib.metadata.version(name) for name in names}}


def geometry(row: dict, network: Network) -> dict[str, dict[str, float]]:
    """Return what each station sees of the target's reference point at the first symbol.

    range_m; psi and omega, the direction cosines along the array's horizontal and vertical axis; radial_mps,
    positive receding; NaN where the row has no place, as a measured target's. Source: paper, Eq. 4, written with
    direction cosines.
    """
    result = {}
    for station in network.stations:
        offset = np.array([row["x_m"], row["y_m"], row["z_m"]]) - np.array(station.position_m)
        distance = float(np.sqrt(offset @ offset))
        towards = offset / distance if distance != 0 else np.zeros(3)
        speed = np.array([row["vx_mps"], row["vy_mps"], row["vz_mps"]])
        result[station.name] = {
            "range_m": distance,
            "psi": float(towards @ station.horizontal),
            "omega": float(towards[2]),
            "radial_mps": float(towards @ speed),
        }
    return result


def record(row: dict, snr_db: float, fold: str, seed: int, network: Network) -> bytes:
    """Return the JSON record of one sample: who it is, how it moves, what each station sees, what made it.

    row: a row of the motion table (NaN becomes null). An infinite SNR is the string "inf".
    """
    names = ("subtype", "category", "group", "model")
    motion = {name: value for name, value in row.items() if name not in (*names, "fold")}
    content = {
        "key": sample_key(row["subtype"], row["model"], snr_db),
        "label": CATEGORIES.index(row["category"]),
        **{name: row[name] for name in names},
        "fold": fold,
        "snr_db": "inf" if math.isinf(snr_db) else snr_db,
        "seed": seed,
        "motion": {name: None if math.isnan(value) else value for name, value in motion.items()},
        "geometry": {
            station: {name: None if math.isnan(value) else value for name, value in seen.items()}
            for station, seen in geometry(row, network).items()
        },
        "versions": versions(),
    }
    return json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
