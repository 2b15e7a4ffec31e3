"""One call for effects, measured on test samples of a run: time, signal, range cells, spectra, images for its network.

    python -m lowalt.measure.effects_samples --settings JSON --motion a.csv ... --clouds b.npz ... --out adc.npz

Settings: name and effects of the call, the blocks network, spectra, images and split of the configuration, seed, the
echo's tolerance, snr_db, size (pixels the network sees) and models (motion models of each subtype). Every sample is
computed with and without the effects, one right after the other, so that both meet the same machine.
"""

import functools
import json
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.common.array_files import UNREADABLE
from lowalt.common.classes import label
from lowalt.common.command import parser, pick, run
from lowalt.common.errors import InputError
from lowalt.common.files import existing, replacing
from lowalt.common.hardware import describe
from lowalt.common.network import Network
from lowalt.common.splits import fold
from lowalt.common.timing import once
from lowalt.motion import read_table
from lowalt.noise.chunk import noisy_signals
from lowalt.scene.catalogue import called
from lowalt.scene.chain import received_signal
from lowalt.scene.observe import Scene
from lowalt.scene.set_noise import behind_canceller, in_all_cells
from lowalt.targets.cloud import Cloud, cloud_of, read
from lowalt.tiles import Renderer, resize, split

STEP = 8
"""A pixel counts as changed if its index (0..255) changes by more: about the least that an eye sees side by side."""
ARRAYS = (
    "subtype", "model", "label", "snr_db", "base_ms", "total_ms", "signal_change", "cells_changed", "pixels_changed",
    "pixel_difference", "views", "example", "example_subtype", "spectra",
)  # fmt: skip
"""subtype, model, label (K,); snr_db (S,); base_ms, total_ms, signal_change and cells_changed (K, stations);
pixels_changed and pixel_difference (K,); views (K, S, V, size, size) uint8; example (2, V, S, S) uint8: the spectra of
the first UAV (of the first target, without one) without and with the effects, free of noise; its name; names of the
spectra, in the order of the tiles."""


class Take(NamedTuple):
    """Signals that the stations received from K motion models in one scene.

    signal: (K, stations, N) complex64; cell: (K, stations, N) range cells; power: (K, stations) W, of the echoes
    alone; ms: (K, stations), processor time each took.
    """

    signal: np.ndarray
    cell: np.ndarray
    power: np.ndarray
    ms: np.ndarray


def held_out(rows: list[dict], share: dict, seed: int, count: int) -> list[dict]:
    """Return the first `count` motion models of each subtype that the split `share` puts into the test fold.

    Raises: InputError where motion models are in several folds, or a subtype has none in the test fold.
    """
    if share["by"] != "motion":
        raise InputError(f"split.by: {share['by']!r}, expected 'motion': else training has seen the test's models")
    found: dict[str, list[dict]] = {}
    for row in rows:
        mine = found.setdefault(row["subtype"], [])
        if len(mine) < count and fold(share, seed, row["subtype"], row["model"]) == "test":
            mine.append(row)
    empty = [name for name, mine in found.items() if not mine]
    if empty or not found:
        raise InputError(f"motion: no test models of {empty or 'any subtype'} among {len(rows)} rows")
    return [row for mine in found.values() for row in mine]


def takes(scenes: list[Scene], clouds: dict[str, Cloud], rows: list[dict], occluders: dict[str, dict]) -> list[Take]:
    """Return the signals of every motion model at all stations in each scene; the scenes take turns sample by sample.

    occluders: surfaces of each subtype, where a scene hides points behind them.
    Raises: InputError naming the sample that has no cloud or cannot be computed with.
    """
    if not scenes:
        return []
    network = scenes[0].network
    shape = (len(rows), len(network.stations))
    found = [
        Take(
            np.empty((*shape, network.symbols), np.complex64), np.empty((*shape, network.symbols), np.int64),
            np.empty(shape), np.empty(shape),
        )
        for _ in scenes
    ]  # fmt: skip
    for index, row in enumerate(rows):
        given = (cloud_of(clouds, row), row, occluders.get(row["subtype"]))
        for place, station in enumerate(network.stations):
            pairs = list(zip(scenes, found, strict=True))
            # Alternate the order, since the second scene finds the target's data in the processor's caches.
            for scene, take in pairs if (index + place) % 2 else pairs[::-1]:
                if index == place == 0:
                    # The first call compiles and fills tables once; its time is not that of a sample.
                    received_signal(scene, station, *given)
                seconds, received = once(functools.partial(received_signal, scene, station, *given), time.process_time)
                take.ms[index, place] = 1e3 * seconds
                take.signal[index, place], take.cell[index, place] = received.signal, received.cell
                take.power[index, place] = received.power
    return found


def signal_change(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return the root mean square of after - before over that of before; both (..., N), the result (...)."""
    before, after = np.asarray(before, np.complex128), np.asarray(after, np.complex128)
    return np.linalg.norm(after - before, axis=-1) / np.linalg.norm(before, axis=-1)


def pixel_change(before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """Return the share of values of two uint8 arrays of equal shape that differ by more than STEP, and the mean |step|.

    Raises: InputError where the shapes differ.
    """
    if before.shape != after.shape:
        raise InputError(f"spectra: shapes {before.shape} and {after.shape}, expected equal shapes")
    step = np.abs(before.astype(np.int16) - after.astype(np.int16))
    return float(np.mean(step > STEP)), float(step.mean())


def views(tiles: Renderer, signals: np.ndarray, size: int) -> np.ndarray:
    """Return the images that a network sees of signals (K, S, stations, N): (K, S, V, size, size) uint8."""
    return np.stack([
        [resize(split(tiles.tile(one), len(tiles.spectra)), size) for one in levels] for levels in signals
    ])  # fmt: skip


def measure(
    scenes: tuple[Scene, Scene], tiles: Renderer, clouds: dict[str, Cloud], rows: list[dict],
    occluders: dict[str, dict], snrs: list[float], size: int, classes: tuple[str, ...],
) -> dict[str, np.ndarray]:  # fmt: skip
    """Return ARRAYS for the samples `rows` in a scene without and one with effects; snrs in dB;
    classes: in the order of their labels.

    Noise is drawn as the noise stage does, so that without effects the images are the run's own.
    Raises: InputError as `takes` does.
    """
    scene, settings = scenes[1], {effect.name: effect.settings for effect in scenes[1].effects}
    inside = in_all_cells(settings)
    before, after = takes([scenes[0], scene.at_snr(snrs[0]) if inside else scene], clouds, rows, occluders)
    names = [station.name for station in tiles.network.stations]
    if inside:
        found = [after, *takes([scene.at_snr(snr) for snr in snrs[1:]], clouds, rows, occluders)]
        noisy = np.stack([take.signal for take in found], axis=1)
    else:
        behind = None
        if "canceller" in settings:
            behind = functools.partial(behind_canceller, canceller=settings["canceller"])
        power = after.power.T if settings else None
        noisy = noisy_signals(after.signal.swapaxes(0, 1), rows, names, snrs, scene.seed, power, behind)
    changed, difference = np.empty(len(rows)), np.empty(len(rows))
    shown = next((index for index, row in enumerate(rows) if row["category"] == classes[0]), 0)
    for index in range(len(rows)):
        pair = [tiles.tile(take.signal[index]) for take in (before, after)]
        changed[index], difference[index] = pixel_change(*pair)
        if index == shown:
            example = np.stack([split(tile, len(tiles.spectra)) for tile in pair])
    return {
        "subtype": np.array([row["subtype"] for row in rows]), "model": np.array([row["model"] for row in rows]),
        "label": np.array([label(classes, row) for row in rows]), "snr_db": np.array(snrs, float),
        "base_ms": before.ms, "total_ms": after.ms, "signal_change": signal_change(before.signal, after.signal),
        "cells_changed": np.mean(before.cell != after.cell, axis=2), "pixels_changed": changed,
        "pixel_difference": difference, "views": views(tiles, noisy, size), "example": example,
        "example_subtype": np.array(rows[shown]["subtype"]), "spectra": np.array(list(tiles.spectra)),
    }  # fmt: skip


def read_samples(path: str | Path) -> tuple[dict, dict[str, np.ndarray]]:
    """Return the header {name, effects, hardware} and ARRAYS of a file this command wrote.

    Raises: InputError where the file is missing or no such file.
    """
    existing(path, "effect")
    try:
        with np.load(path, allow_pickle=False) as data:
            return json.loads(str(data["header"])), {name: data[name] for name in ARRAYS}
    except UNREADABLE as error:
        raise InputError(f"{path}: not a file of an effect's samples ({error})") from error


def main(arguments: list[str]) -> None:
    """Measure one call for effects and write its file."""
    options = parser("lowalt.measure.effects_samples", __doc__.splitlines()[0])
    options.add_argument("--motion", nargs="+", required=True, help="motion tables that have test models")
    options.add_argument("--clouds", nargs="+", required=True, help="cloud files of their subtypes")
    options.add_argument("--occluders", nargs="*", default=[], help="surface files of their subtypes")
    options.add_argument("--out", required=True, help="file to write (.npz)")
    given = options.parse_args(arguments)
    keys = ("name", "effects", "network", "spectra", "images", "split", "seed", "tolerance", "snr_db", "size", "models",
            "classes")  # fmt: skip
    block = dict(zip(keys, pick(given.settings, *keys), strict=True))
    network = Network.from_settings(block["network"])
    tiles = Renderer.from_settings({key: block[key] for key in ("network", "spectra", "images")})
    rows = [row for path in given.motion for row in read_table(path)]
    rows = held_out(rows, block["split"], block["seed"], block["models"])
    clouds = {cloud.subtype: cloud for cloud in map(read, given.clouds)}
    occluders = {}
    if given.occluders:
        from lowalt.targets.occluders import read_all

        occluders = read_all(given.occluders)
    base = Scene(network, block["seed"], block["tolerance"], ())
    scene = Scene(network, block["seed"], block["tolerance"], tuple(called(block["effects"])))
    snrs = [float(snr) for snr in block["snr_db"]]
    found = measure((base, scene), tiles, clouds, rows, occluders, snrs, block["size"], tuple(block["classes"]))
    header = {"name": block["name"], "effects": list(block["effects"]), "hardware": describe()}
    with replacing(given.out) as temporary:
        np.savez_compressed(temporary, header=np.array(json.dumps(header, sort_keys=True)), **found)


if __name__ == "__main__":
    run(main)
