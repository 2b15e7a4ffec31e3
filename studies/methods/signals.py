"""Samples of methods that see slow-time signals or their physical features instead of images."""

from pathlib import Path

import numpy as np
from features import features

import trainings
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.motion import read_table
from lowalt.recognition.samples import Samples, fingerprint
from lowalt.recognition.schemes import Scheme
from lowalt.tiles.signals import load_signals


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
    """Noisy signals (samples, stations, symbols) complex64 of a run's (group, fold) pairs, held in memory."""

    def __init__(self, data: Path, scheme: Scheme, pairs: set[tuple[str, str]], size: int) -> None:
        """data: folder of a finished run with noisy signals and views of `size` pixels, which say what each sample is.

        Raises: InputError where a sample has no signal.
        """
        images = Scheme(scheme.name, scheme.stations, (0,))
        self.facts = trainings.images_of(data, images, pairs, size).facts
        config = load_yaml(data / "config.yaml")
        self.network = Network.from_settings(config["network"])
        levels = {float(snr): place for place, snr in enumerate(config["noise"]["snr_db"])}
        places, chunks = {}, []
        for path in sorted((data / "noisy").glob("*.npy")):
            for row, one in enumerate(read_table(data / "motion" / f"{path.stem}.csv")):
                places[one["subtype"], one["model"]] = len(chunks), row
            chunks.append(load_signals(path, self.network))
        self.values = np.empty((len(self.facts), len(scheme.stations), self.network.symbols), np.complex64)
        for number, key in enumerate(zip(self.facts.subtype.tolist(), self.facts.model.tolist(), strict=True)):
            if key not in places:
                raise InputError(
                    f"{data}/noisy: no signal of {key}, expected those of all chunks: `snakemake -- signals`"
                )
            chunk, row = places[key]
            self.values[number] = chunks[chunk][row, levels[self.facts.snr_db[number]]][list(scheme.stations)]
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

    def features(self) -> np.ndarray:
        """Return the physical features (samples, stations times features) float32 of all samples."""
        interval_s, columns = self.network.symbol_interval_s, []
        for place in range(self.values.shape[1]):
            # Blocks bound the memory that the spectra of all samples would take.
            frequency_hz, own = self.network.stations[place].frequency_hz, self.values[:, place]
            starts = range(0, len(own), 256)
            blocks = [features(own[start : start + 256], frequency_hz, interval_s) for start in starts]
            columns.append(np.concatenate(blocks))
        return np.concatenate(columns, axis=1)
