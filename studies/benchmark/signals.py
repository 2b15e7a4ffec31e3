"""Samples of methods that see slow-time signals or their physical features instead of images."""

import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from features import features

from lowalt.config.network import Network
from lowalt.extensions.benchmark.definition import PARTS, config_of, run_name
from lowalt.extensions.benchmark.part_samples import TrackSamples
from lowalt.files.atomic import replacing
from lowalt.recognition.samples import Samples, fingerprint
from lowalt.tiles.signals import load_signals

BLOCK = 256
"""Signals whose spectra are in memory at a time."""


def augmented(signals: np.ndarray, block: dict, generator: np.random.Generator) -> np.ndarray:
    """Return changed copies of signals (samples, stations, symbols) complex64; equal generators give equal changes.

    `mirror` of the block turns all Doppler frequencies around, `shift_time` shifts cyclically in time; each station's
    signal is also turned by a random phase, which a target's range decides.
    """
    samples, stations, symbols = signals.shape
    draws = generator.random((samples, 2))
    phases = np.exp(2j * np.pi * generator.random((samples, stations, 1)))
    result = signals * phases.astype(np.complex64)
    for number, (mirror, shift) in enumerate(draws):
        if mirror < block["mirror"]:
            result[number] = result[number].conj()
        result[number] = np.roll(result[number], round((2 * shift - 1) * block["shift_time"] * symbols), axis=-1)
    return result


class Signals(Samples):
    """Signals (samples, stations, symbols) complex64 of a track's part, as a source for trainings."""

    def __init__(self, samples: TrackSamples) -> None:
        """Take the samples of a track's part."""
        self.facts, self.values = samples.facts, samples.signals
        self.size = self.values.shape[-1]

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Signals (len(numbers), stations, symbols) complex64 of the samples `numbers`."""
        return self.values[numbers]

    def changed(self, numbers, columns, block, generator) -> np.ndarray:
        """Return signals augmented."""
        return augmented(self.values[numbers], block, generator)

    def sha256(self) -> str:
        """Return the SHA-256 of all that a training sees of these samples."""
        return fingerprint(self.facts, np.ascontiguousarray(self.values).view(np.uint8).data)


def told(path: Path, folder: Path, told_of: Callable[[np.ndarray, float, float], np.ndarray]) -> np.ndarray:
    """Return numbers (models, SNRs, stations, numbers) float32 of all signals of a chunk; made once, then kept.

    path: the chunk's noisy signals; folder: where the numbers are kept; told_of: a function of signals (B, N), the
    station's frequency (Hz) and the symbol interval (s), as `features.features`.
    """
    run = path.parents[1].name
    kept = folder / told_of.__name__ / run / path.name
    if not kept.is_file():
        part = next(part for part in PARTS if run_name(part) == run)
        begun = time.process_time()
        network, columns = Network.from_settings(config_of(part)["network"]), []
        chunk = load_signals(path, network)
        for place, station in enumerate(network.stations):
            own = chunk[:, :, place].reshape(-1, network.symbols)
            blocks = [told_of(own[start : start + BLOCK], station.frequency_hz, network.symbol_interval_s)
                      for start in range(0, len(own), BLOCK)]  # fmt: skip
            columns.append(np.concatenate(blocks).reshape(*chunk.shape[:2], -1))
        with replacing(kept) as temporary, temporary.open("wb") as file:
            np.save(file, np.stack(columns, axis=2).astype(np.float32))
        seconds = (time.process_time() - begun) / (chunk.shape[0] * chunk.shape[1])
        with replacing(kept.with_suffix(".json")) as temporary:
            temporary.write_text(json.dumps({"core_s_per_sample": seconds}) + "\n")
    return np.load(kept, mmap_mode="r")


def cost_s(folder: Path, told_of: Callable, run: str) -> float:
    """Return the mean core-seconds per sample of a run that the function took, whose results are kept."""
    paths = (folder / told_of.__name__ / run).glob("*.json")
    return float(np.mean([json.loads(path.read_text())["core_s_per_sample"] for path in paths]))


def features_of(samples: TrackSamples, folder: Path, told_of: Callable = features) -> np.ndarray:
    """Return the features (samples, stations * features) float32 of a track's part, side by side; as `told`."""
    return samples.of_chunks(lambda path: told(path, folder, told_of)).reshape(len(samples), -1)
