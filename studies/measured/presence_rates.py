"""How often a window of noise is taken for a target, and a window with a target for noise: measured-presence.csv.

Every row is of simulated recordings of `WINDOWS` windows through a twin, judged by `presence.present` as recordings
are, from their own noise alone.
    radar, scene     white: white noise alone; receiver: the noise, leak and hum of receivers drawn as for training;
                     empty: the same recordings where the first `EMPTY` windows are known to hold no target
                     (radars whose targets may hover);
                     a category: its scenes, each at a receiver from the middle of the ranges, with the echo snr_db over
                     the white noise of the receiver's band
    windows          with a target (a category) or without one (white, receiver)
    taken_percent    share of them that is taken for a target, with its 95 % interval over recordings: a false alarm
                     for noise, a hit for a category (a miss is what is left to 100)
UAVs and birds that may hover are in all windows of a recording, others in a quarter of them.
"""

import math

import numpy as np

from lowalt.config.classes import CATEGORIES
from lowalt.extensions.recordings.channel import coherent_intervals
from lowalt.extensions.recordings.presence import present
from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_scenes import MARGIN, Library, clouds_of, heard, samples, stretch, value
from lowalt.numerics.streams import stream

PRESENCE = ("radar", "scene", "snr_db", "recordings", "windows", "taken_percent", "low", "high")
HOVER = ("UAV", "Bird")
WINDOWS = 24
SNRS_DB = (-20.0, -10.0, 0.0, 10.0, 20.0)
EMPTY = 5
REPEATS = 2000


def middle(receiver: dict, snr_db: float) -> dict:
    """Return a receiver's settings at the middle of their ranges, at an SNR (dB), without hum."""
    fixed = {key: float(np.mean(item)) for key, item in receiver.items()}
    return fixed | {"snr_db": snr_db, "hum_db": -200.0, "clip_rms": 0.0}


def hovering(twin: Twin, receiver: dict, echo: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the windows (WINDOWS, symbols) of a recording whose target is there all the time, of its echo (N,)."""
    seconds = WINDOWS * twin.symbols * twin.symbol_interval_s
    return coherent_intervals(stretch(samples(twin, receiver, echo, rng), twin, seconds), twin.symbols, slow=twin.slow)


def recorded(twin: Twin, receiver: dict, echo: np.ndarray, targets: int, rng: np.random.Generator) -> np.ndarray:
    """Return the windows (WINDOWS, symbols) of a recording, of which the first `targets` hold the echo (N,)."""
    seconds = twin.symbols * twin.symbol_interval_s
    parts = [stretch(samples(twin, receiver, echo, rng, number < targets), twin, seconds) for number in range(WINDOWS)]
    return coherent_intervals(np.concatenate(parts), twin.symbols, slow=twin.slow)


def _row(name: str, scene: str, snr_db: float, taken: list[np.ndarray], rng: np.random.Generator) -> list:
    """A row of `PRESENCE`; taken: which windows (n,) of each recording are taken for a target."""
    shares = np.array([100 * part.mean() for part in taken])
    low, high = np.quantile(shares[rng.integers(0, len(shares), (REPEATS, len(shares)))].mean(axis=1), [0.025, 0.975])
    return [name, scene, snr_db, len(taken), sum(map(len, taken)), float(shares.mean()), float(low), float(high)]


def noise_rows(name: str, library: Library, count: int) -> list[list]:
    """Return the rows of noise alone of the radar `name`, each of `count` recordings."""
    twin, rows = library.twins[name], []
    scenes = [scene for category in CATEGORIES for scene in library.scenes[name][category]]
    samples_of_window = math.ceil(twin.symbols * twin.symbol_interval_s * twin.rate_hz)
    margin = math.ceil(2 * MARGIN * twin.symbol_interval_s * twin.rate_hz)
    for kind in ("white", "receiver"):
        taken: dict[str, list[np.ndarray]] = {kind: []} | (
            {"empty": []} if kind == "receiver" and not twin.slowest_mps else {}
        )
        for number in range(count):
            rng = stream(library.seed, "presence", name, kind, number)
            drawn = {key: value(item, rng) for key, item in scenes[number % len(scenes)]["receiver"].items()}
            if kind == "white":
                drawn |= dict.fromkeys(("flicker_db", "leak_db", "hum_db"), -200.0)
                drawn |= {"highpass_hz": 0.0, "clip_rms": 0.0}
            # The echo of a moving point sets the level of the noise, and is left out.
            point = np.exp(0.3j * np.arange(samples_of_window + margin))
            windows = recorded(twin, drawn, point, 0, rng)
            taken[kind].append(present(windows, twin))
            if "empty" in taken:
                taken["empty"].append(present(windows[EMPTY:], twin, windows[:EMPTY]))
        rows += [_row(name, scene, math.nan, found, stream(library.seed, "presence", name, scene, "interval"))
                 for scene, found in taken.items()]  # fmt: skip
    return rows


def target_rows(name: str, library: Library, count: int) -> list[list]:
    """Return the rows of each category in front of the radar `name` at every SNR, each of `count` recordings."""
    twin, rows = library.twins[name], []
    window_s = twin.symbols * twin.symbol_interval_s
    for category in CATEGORIES:
        stays = not twin.slowest_mps and category in HOVER
        targets = WINDOWS if stays else WINDOWS // 4
        scenes = library.scenes[name][category]
        clouds = clouds_of(library.records, list(dict.fromkeys(s for scene in scenes for s in scene["subtypes"])), 0)
        taken: dict[float, list[np.ndarray]] = {snr_db: [] for snr_db in SNRS_DB}
        for number in range(count):
            scene = scenes[number % len(scenes)]
            rng = stream(library.seed, "presence", name, category, number)
            echo, _ = heard(twin, scene, clouds, rng, WINDOWS * window_s if stays else window_s)
            for snr_db in SNRS_DB:
                receiver = middle(scene["receiver"], snr_db)
                windows = (hovering(twin, receiver, echo, rng) if stays
                           else recorded(twin, receiver, echo, targets, rng))  # fmt: skip
                taken[snr_db].append(present(windows, twin)[:targets])
        for snr_db, parts in taken.items():
            rng = stream(library.seed, "presence", name, category, "interval", snr_db)
            rows.append(_row(name, category, snr_db, parts, rng))
    return rows
