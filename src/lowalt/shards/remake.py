"""Recomputes a stored sample from its record, the index and the cloud, and compares every byte."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from lowalt.config.network import Network
from lowalt.config.schema import check_brought
from lowalt.files.atomic import existing, slug
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.scene.effects import complete, needs_surfaces, of_record
from lowalt.scene.trust import refuse_effects
from lowalt.shards.maker import Maker
from lowalt.shards.read import ShardSet
from lowalt.shards.sample_record import accompanied, record, row_of
from lowalt.shards.stored_cubes import cell_type_of
from lowalt.targets.cloud import Cloud, read
from lowalt.targets.occluders import read_all


class CloudFolder(Mapping):
    """The clouds of a run's folder by subtype, each read on first access."""

    def __init__(self, folder: str | Path) -> None:
        """Name the folder; nothing is read yet."""
        self.folder = Path(folder)
        self._clouds: dict[str, Cloud] = {}

    def __getitem__(self, subtype: str) -> Cloud:
        if subtype not in self._clouds:
            path = existing(self.folder / f"{slug(subtype)}.npz", f"cloud of {subtype}")
            self._clouds[subtype] = read(path)
        return self._clouds[subtype]

    def __contains__(self, subtype: object) -> bool:
        return (self.folder / f"{slug(str(subtype))}.npz").is_file()

    def __iter__(self) -> Iterator[str]:
        return (read(path).subtype for path in sorted(self.folder.glob("*.npz")))

    def __len__(self) -> int:
        return len(list(self.folder.glob("*.npz")))


class Remaker:
    """Recomputes the samples of one data set."""

    def __init__(
        self, shards: ShardSet, clouds: Mapping[str, Cloud], occluders: dict | None = None
    ) -> None:
        """Take the data set and the clouds by subtype.

        occluders: each subtype's surfaces, where effects need them. Raises: InputError where the
        index does not say how echoes were computed, or names code among the effects.
        """
        if not shards.index.get("echo"):
            raise InputError(
                f"{shards.index_path}: does not say how echoes were computed, expected an index "
                f"that lowalt 0.2 or later wrote, found format {shards.index['format']}"
            )
        refuse_effects(shards.index["echo"]["effects"], shards.index_path)
        self.shards = shards
        self.clouds = clouds
        self.occluders = occluders
        self.network = Network.from_settings(shards.index["render"]["network"])
        self._makers: dict[int, Maker] = {}
        self._recorded = complete(of_record(shards.index["echo"]["effects"]))

    def _maker(self, seed: int) -> Maker:
        """The maker of samples with a random seed."""
        if seed not in self._makers:
            index = self.shards.index
            self._makers[seed] = Maker(
                index["render"], index["echo"], seed, self.clouds, self.occluders
            )
        return self._makers[seed]

    def signal(self, entry: dict) -> np.ndarray:
        """Return the signals (stations, symbols) complex64 of the sample that a record describes.

        Raises: InputError as `made`.
        """
        row, snr_db = row_of(entry)
        check_brought("record", entry, self.shards.index_path)
        return self._maker(entry["seed"]).signal(row, snr_db)

    def made(self, entry: dict) -> tuple[bytes, bytes]:
        """Return record and data (PNG or .npy) of the sample that a record describes.

        Raises: InputError naming the sample whose record is too old or whose cloud is missing.
        """
        row, snr_db = row_of(entry)
        seed = entry["seed"]
        signal = self.signal(entry)
        maker = self._maker(seed)
        data, cubes = maker.data(self.shards.kind, signal, row, snr_db, cell_type_of(entry))
        row = accompanied(row, self._recorded, seed, self.network)
        classes = self.shards.classes
        again = record(row, snr_db, entry["fold"], seed, self.network, classes, cubes)
        return again, data

    def faults(self, number: int) -> list[str]:
        """Return one line for each member of a sample that differs from the stored one.

        Raises: InputError as `made`, or where the stored sample is damaged.
        """
        stored, data = self.shards.members(number)
        key = self.shards.keys[number].decode()
        stored_again, data_again = self.made(json.loads(stored))
        lines = []
        if stored_again != stored:
            lines.append(f"sample {key}: its record comes out otherwise")
        if data_again != data:
            lines.append(f"sample {key}: its {self.shards.kind} comes out otherwise")
        return lines


def number_of(shards: ShardSet, key: str) -> int:
    """Return the number of the sample with this key.

    Raises: InputError where the data set has none.
    """
    numbers = np.flatnonzero(shards.keys == key.encode())
    if not len(numbers):
        raise InputError(
            f"--sample {key!r}: not in {shards.index_path}, expected a key such as "
            f"{shards.keys[0].decode()!r}"
        )
    return int(numbers[0])


def some(shards: ShardSet, count: int) -> list[int]:
    """Return the numbers of `count` samples, drawn with the index's checksum as seed, or of all."""
    draws = stream(0, "remake", shards.index["sha256"])
    return sorted(draws.choice(len(shards), min(count, len(shards)), replace=False).tolist())


def opened(
    index: str | Path, clouds: str | Path | None = None, occluders: str | Path | None = None
) -> Remaker:
    """Return an object that makes the samples of a run's data set again.

    clouds: folder of the run's clouds, by default `clouds` next to the folder of the index;
    occluders: folder of the run's surfaces, by default `occluders` next to that of the clouds.
    Surfaces are read only where effects need them.
    Raises: InputError if the index or a surface cannot be read, or the index is too old.
    """
    shards = ShardSet(index)
    surfaces = None
    clouds = Path(clouds or Path(index).resolve().parent.parent / "clouds")
    effects = (shards.index.get("echo") or {}).get("effects", {})
    refuse_effects(effects, shards.index_path)
    if needs_surfaces(effects):
        surfaces = read_all(sorted(Path(occluders or clouds.parent / "occluders").glob("*.npz")))
    return Remaker(shards, CloudFolder(clouds), surfaces)
