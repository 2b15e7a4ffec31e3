"""Samples of methods that see slow-time signals or their physical features instead of images."""

from pathlib import Path

import numpy as np
from features import features

from lowalt.benchmark.part_samples import TrackSamples
from lowalt.config.network import Network
from lowalt.files.atomic import replacing
from lowalt.recognition.samples import Samples, fingerprint

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


def features_of(samples: TrackSamples, folder: Path) -> np.ndarray:
    """Return the physical features (samples, stations * features) float32 of a track's part.

    folder: where the features of all three stations are kept by the part's keys, so that tracks share them.
    """
    kept = folder / f"{samples.run.name}-{fingerprint(samples.facts)[:16]}-{len(samples.track.stations)}.npy"
    if not kept.is_file():
        network = Network.from_settings(samples.config["network"])
        columns = []
        for place, station in enumerate(samples.track.stations):
            own, frequency_hz = samples.signals[:, place], network.stations[station].frequency_hz
            blocks = [features(own[start : start + BLOCK], frequency_hz, network.symbol_interval_s)
                      for start in range(0, len(own), BLOCK)]  # fmt: skip
            columns.append(np.concatenate(blocks))
        with replacing(kept) as temporary, temporary.open("wb") as file:
            np.save(file, np.concatenate(columns, axis=1))
    return np.load(kept)
