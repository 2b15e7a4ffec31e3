"""Samples for methods that see slow-time signals or their physical features instead of images, from cache files.

A cache file (.npz) holds, for the samples of one shard in its order,
    signals   (samples, stations, symbols) complex64, the noisy signals
    features  (samples, stations, features) float32, `lowalt.recognition.features.NAMES` of each
    one array (samples,) for every name of FACTS
`SlowTimeSamples` answers the same calls as `ViewSamples`.
"""

import sys
from pathlib import Path

import numpy as np

from lowalt.common.command import parser, pick, run
from lowalt.common.errors import InputError
from lowalt.common.files import replacing
from lowalt.common.network import Network
from lowalt.recognition.features import NAMES, features
from lowalt.recognition.samples import FACTS, Facts, cached, fingerprint, joined
from lowalt.recognition.views import ChunkFile, facts_of, located
from lowalt.shards import ShardSet
from lowalt.tiles.signals import load_signals

KINDS = ("signals", "features")


class Noisy(ChunkFile):
    """Noisy signals of a whole chunk from the noise stage, (models, SNRs, stations, symbols) complex64 (.npy)."""

    def signals(self, facts: Facts, network: Network) -> np.ndarray:
        """Return the signals (len(facts), stations, symbols) complex64 of these samples.

        Raises: InputError where the chunk has no such motion model or SNR, or the file does not fit the network.
        """
        models, snrs, shape = self.places(facts)
        found = load_signals(self.path, network)
        if found.shape[:2] != shape:
            raise InputError(f"{self.path}: {found.shape[:2]} models and SNRs, expected {shape}")
        return found[models, snrs]


def of_stations(signals: np.ndarray, network: Network) -> np.ndarray:
    """Return the physical features (samples, stations, features) float32 of signals (samples, stations, symbols)."""
    columns = [
        features(signals[:, number], station.frequency_hz, network.symbol_interval_s)
        for number, station in enumerate(network.stations)
    ]
    return np.stack(columns, axis=1)


def cache_shard(index: str | Path, name: str, out: str | Path, source: Noisy | None = None) -> int:
    """Write the cache file of the shard `name` and return its number of samples.

    source: the noisy signals of the shard's chunk; without it, the shards themselves hold the signals.
    Raises: InputError where the index has no such shard, it holds no signals, or it is damaged.
    """
    shards, numbers = located(index, name)
    facts = facts_of(ShardSet(index, check=False), numbers)
    network = Network.from_settings(shards.index["render"]["network"])
    found = source.signals(facts, network) if source else np.stack([shards.signal(number) for number in numbers])
    found = np.ascontiguousarray(found, dtype=np.complex64)
    # Blocks bound the memory that the spectra of all samples would take.
    blocks = [of_stations(found[start : start + 256], network) for start in range(0, len(found), 256)]
    with replacing(out, found.nbytes) as temporary:
        known = {name: getattr(facts, name) for name in FACTS}
        np.savez(temporary, signals=found, features=np.concatenate(blocks), **known)
    return len(numbers)


class SlowTimeSamples:
    """Signals or features held in memory, read from cache files; some stations, groups and folds only."""

    HELD = "values"

    def __init__(self, paths: list[str | Path], kind: str, stations: list[int], folds: set[tuple[str, str]]) -> None:
        """paths: cache files; kind: "signals" or "features"; stations: numbers to keep; folds: (group, fold) pairs.

        Raises: InputError naming a file that is no such cache, or where nothing is left.
        """
        parts = [found for path in sorted(map(Path, paths)) if (found := _load(path, kind, stations, folds))]
        if not parts:
            raise InputError(f"signals: none of the {len(paths)} files has samples of {sorted(folds)}")
        lengths = {array.shape[-1] for array, _ in parts}
        if len(lengths) > 1:
            raise InputError(f"signals: lengths {sorted(lengths)}, expected one length")
        self.values = np.concatenate([array for array, _ in parts])
        self.facts = joined([facts for _, facts in parts])
        self.size = self.values.shape[-1]

    def keep(self, numbers: np.ndarray) -> None:
        """Drop all samples but those at `numbers`."""
        self.values, self.facts = self.values[numbers], self.facts.take(numbers)

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Signals (len(numbers), stations, symbols) complex64 or features (..., features) float32 of some samples."""
        return self.values[numbers]

    def sha256(self) -> str:
        """Return the SHA-256 of all that a training sees of these samples."""
        return fingerprint(self.facts, np.ascontiguousarray(self.values).view(np.uint8).data)


def _load(path: Path, kind: str, stations: list[int], folds: set) -> tuple[np.ndarray, Facts] | None:
    """Return the values and facts of a cache file that are in `folds`, None where none is."""
    found = cached(path, "signals", folds, kind)
    if found is None:
        return None
    facts, keep, values = found.facts, found.keep, found.arrays[kind]
    wanted = {"signals": np.complex64, "features": np.float32}[kind]
    if values.ndim != 3 or values.shape[:2] != (len(facts), facts.range_m.shape[1]) or values.dtype != wanted:
        raise InputError(f"{path}: {kind} {values.dtype} {values.shape}, expected {wanted.__name__} of all stations")
    if kind == "features" and values.shape[2] != len(NAMES):
        raise InputError(f"{path}: {values.shape[2]} features, expected the {len(NAMES)} of this version")
    if max(stations) >= values.shape[1]:
        raise InputError(f"{path}: {values.shape[1]} stations, the scheme needs {1 + max(stations)}")
    return values[keep][:, stations], facts.take(keep)


def main(arguments: list[str]) -> None:
    """Write the signals and physical features of one shard. Settings: snr_db."""
    line = parser("lowalt.recognition.slow_time", main.__doc__)
    line.add_argument("--index", required=True, help="index of the shards (.json)")
    line.add_argument("--shard", required=True, help="name of the shard, {group}-{fold}-{part}.tar")
    line.add_argument("--noisy", help="noisy signals of the shard's chunk (.npy), where shards hold images")
    line.add_argument("--motion", help="with --noisy: motion table of the chunk")
    line.add_argument("--out", required=True, help="signals and features to write (.npz)")
    given = line.parse_args(arguments)
    (levels,) = pick(given.settings, "snr_db")
    if (given.noisy is None) != (given.motion is None):
        raise InputError("expected both --noisy and --motion, or neither")
    source = Noisy(Path(given.noisy), Path(given.motion), tuple(map(float, levels))) if given.noisy else None
    count = cache_shard(given.index, given.shard, given.out, source)
    print(f"{given.out}: {count} samples", file=sys.stderr)


if __name__ == "__main__":
    run(main)
