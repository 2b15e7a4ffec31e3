"""Shards of kind `recipe`: clean echoes of each motion model, to which readers add noise.

A sample of such a shard has two members: {subtype}-{model}.clean.npy holds the echoes without
noise, and the record of the same key has lists at `snr_db` and `noise`. In a scene with effects the
record also has the reference powers of the SNRs and the effects that filter the noise. Record
and signals of each sample are computed from these, with the same bytes as in a shard of signals.
"""

import io
import json
import math
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from lowalt.config.named_code import own_effects
from lowalt.files.errors import InputError
from lowalt.noise.awgn import noisy_signals
from lowalt.scene.effects import PLACES, module_of
from lowalt.scene.set_noise import filtering, in_all_cells
from lowalt.shards.sample_list import sample_key
from lowalt.shards.sample_record import encoded

POWER = "power_w"
"""Field of the record: the power (W) that SNRs refer to, one number per station. Without it, the
echoes' own power.
"""
FILTERS = tuple(name for name, place in PLACES.items() if place == "detection")
"""Fields of the record for effects that the noise passes, by name: their settings as JSON text,
absent without such an effect.
"""


def refuse(effects: dict) -> None:
    """Refuse a scene in which noise is not simply added to the clean echoes of one range cell.

    effects: the configuration's block. Raises: InputError naming the effect.
    """
    noisy = in_all_cells(effects)
    if noisy:
        raise InputError(
            f"shards.kind: 'recipe' with the effect {noisy[0]!r}, whose echoes hold noise; "
            "expected signal or image"
        )
    own = [name for name in own_effects(effects) if hasattr(module_of(name), "filtered")]
    if own:
        raise InputError(
            f"shards.kind: 'recipe' with the effect {own[0]!r}, whose code a reader of the shards "
            "would need for the noise; expected signal or image"
        )


def recipe_record(
    record: bytes,
    key: str,
    snrs_db: Iterable[float],
    power_w: Iterable[float] | None,
    filters: Mapping[str, dict],
) -> bytes:
    """Return the record of a motion model, made from the record of one of its samples.

    key: the model's own; snrs_db: SNRs of its samples, +inf for no noise; power_w: see POWER,
    None where it is absent; filters: the effects that filter the noise, see FILTERS.
    """
    snrs = [float(snr) for snr in snrs_db]
    entry = json.loads(record)
    entry |= {"key": key, "snr_db": snrs}
    entry["noise"] = [not math.isinf(snr) for snr in snrs]
    if power_w is not None:
        entry[POWER] = [float(power) for power in power_w]
    for name, settings in filters.items():
        entry[name] = json.dumps(settings, sort_keys=True)
    return encoded(entry)


def sample_snrs(entry: dict) -> list[float]:
    """Return the SNRs (dB) of a motion model's samples by its parsed record, +inf for no noise.

    Raises: InputError where the record is not one of a shard of kind `recipe`.
    """
    if not isinstance(entry.get("snr_db"), list):
        raise InputError(
            f"record of {entry.get('key')}: one SNR, expected a list of them as recipe shards have"
        )
    levels = []
    for snr_db, is_noisy in zip(entry["snr_db"], entry["noise"], strict=True):
        levels.append(snr_db if is_noisy else math.inf)
    return levels


def unpacked(entry: dict, snr_db: float) -> bytes:
    """Return the record of one sample of a motion model as a shard of signals stores it.

    Raises: InputError where the model has no sample of this SNR.
    """
    if snr_db not in sample_snrs(entry):
        raise InputError(
            f"record of {entry['key']}: SNRs {sample_snrs(entry)} dB, expected {snr_db} dB among "
            "them"
        )
    kept = {name: value for name, value in entry.items() if name not in (POWER, *FILTERS)}
    kept |= {
        "key": sample_key(entry["subtype"], entry["model"], snr_db),
        "noise": not math.isinf(snr_db),
    }
    kept["snr_db"] = snr_db
    return encoded(kept)


def noisy(entry: dict, clean: np.ndarray, stations: list[str], snr_db: float) -> np.ndarray:
    """Return the signals of one sample from a motion model's clean echoes.

    Both are (stations, symbols) complex64.
    """
    powers = None
    if POWER in entry:
        powers = np.array(entry[POWER])[:, None]
    filtered = filtering({name: json.loads(entry[name]) for name in FILTERS if name in entry})
    echoes = clean[:, None]
    signals = noisy_signals(echoes, [entry], stations, [snr_db], entry["seed"], powers, filtered)
    return signals[0, 0]


def complex_signals(stored: np.ndarray) -> np.ndarray:
    """Return the signals of a stored array (stations, symbols, 2) float32.

    Version 0.1 stored complex64, which is returned as it is.
    """
    if stored.dtype == np.complex64:
        return stored
    return np.ascontiguousarray(stored).view(np.complex64)[..., 0]


def samples(models: Iterable[dict]) -> Iterator[dict]:
    """Yield all samples as signal shards hold them, of motion models read from recipe shards.

    models: dicts with `json` and `clean.npy`, as bytes or decoded, as in a pipeline of webdataset.
    Yields dicts with `__key__`, `json` (parsed) and `npy`, (stations, symbols, 2) float32. For
    example `webdataset.WebDataset(path, shardshuffle=False).compose(lowalt.shards.clean.samples)`.
    """
    for model in models:
        entry = model["json"]
        if isinstance(entry, (bytes, str)):
            entry = json.loads(entry)
        stored = model["clean.npy"]
        if isinstance(stored, bytes):
            stored = np.lib.format.read_array(io.BytesIO(stored))
        clean = complex_signals(np.asarray(stored))
        stations = list(entry["geometry"])
        for snr_db in sample_snrs(entry):
            record = json.loads(unpacked(entry, snr_db))
            signal = noisy(entry, clean, stations, snr_db)
            pairs = np.ascontiguousarray(signal).view(np.float32).reshape(*signal.shape, 2)
            yield {**model, "__key__": record["key"], "json": record, "npy": pairs}
