"""Random access to the samples of shards; each access verifies the sample.

Torch is not imported: `len` and one of the methods below are enough for a data set of any
framework.
"""

import functools
import hashlib
import io
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import ModuleType
from typing import NoReturn

import numpy as np

from lowalt.config.blocks import render_blocks
from lowalt.config.classes import stated
from lowalt.config.extensions import module_offered, offered
from lowalt.config.network import station_names
from lowalt.config.splits import FOLDS
from lowalt.files.atomic import existing, sha256
from lowalt.files.errors import InputError
from lowalt.files.json_objects import json_object
from lowalt.scene.lateness import lateness
from lowalt.scene.trust import refuse_effects
from lowalt.shards.clean import complex_signals, noisy, unpacked
from lowalt.shards.index import WHAT, checked, load
from lowalt.shards.plan import GROUPS
from lowalt.shards.sample_list import refuse_unknown
from lowalt.shards.sample_record import npy, row_of
from lowalt.shards.sample_table import MOST_OVERHEAD_BYTES, SAMPLE, map_samples, table_path
from lowalt.shards.stored_cubes import cubes_of
from lowalt.spectra.catalogue import named, of_cells
from lowalt.spectra.cube import Cube
from lowalt.tiles.image_settings import Images
from lowalt.tiles.png import decode
from lowalt.tiles.render import Renderer, split
from lowalt.tiles.resample import resize

MOST_INDEX_BYTES = 64 << 20


@functools.cache
def store_of(scheme: str) -> ModuleType:
    """Return the module of the extension that reads data sets at addresses SCHEME://...

    Raises: InputError where no extension does.
    """
    stores = offered("stores")
    if scheme not in stores:
        raise InputError(
            f"{scheme}://: no extension reads such addresses, expected a file or one of "
            f"{sorted(stores)}"
        )
    return module_offered("stores", scheme, stores[scheme])


class ShardSet:
    """The samples of some groups and folds of a data set, numbered in the order of the index.

    Of a data set on a web server, only the index, the tables of the shards in use and the samples
    asked for are read. It can be pickled; each worker memory-maps the tables itself. Every access
    checks the sample's SHA-256, unless `check` is False.
    """

    def __init__(
        self,
        index_path: str | Path,
        groups: Iterable[str] = GROUPS,
        folds: Iterable[str] = FOLDS,
        check: bool = True,
    ) -> None:
        """Select the shards of these groups and folds.

        index_path: a file, or an address that an extension reads, such as https://... on a server
        that sends byte ranges.
        Raises: InputError naming an unknown group or fold, or a file that is missing or damaged.
        """
        self._base = str(index_path)
        scheme, separator, _ = self._base.partition("://")
        self.remote = bool(scheme and separator)
        self.scheme = scheme if self.remote else ""
        self.index_path = self._base if self.remote else Path(index_path)
        self.groups = tuple(groups)
        self.folds = tuple(folds)
        self.check = check
        refuse_unknown(self.groups, self.folds)
        self.index = self._fetched_index() if self.remote else load(index_path)
        self.kind = self.index["kind"]
        self.classes = stated(self.index)
        self.shards = []
        for entry in self.index["shards"]:
            if entry["group"] in self.groups and entry["fold"] in self.folds:
                self.shards.append(entry)
        self._ends = np.cumsum([0, *(shard["samples"] for shard in self.shards)])
        self._tables: dict[int, np.ndarray] = {}

    def __len__(self) -> int:
        return int(self._ends[-1])

    def __getstate__(self) -> dict:
        """State for pickle, without the tables that each process makes for itself."""
        kept = {name: value for name, value in self.__dict__.items() if name != "renderer"}
        return {**kept, "_tables": {}}

    def _fetched_index(self) -> dict:
        """The index from its address."""
        store = store_of(self.scheme)
        text = store.span(self._base, 0, MOST_INDEX_BYTES).decode(errors="replace")
        return checked(json_object(text, self._base, WHAT), self._base)

    def _read(self, shard: int, offset: int, size: int) -> bytes:
        """At most `size` bytes of a shard from `offset` on."""
        name = self.shards[shard]["path"]
        if self.remote:
            store = store_of(self.scheme)
            return store.span(store.beside(self._base, name), offset, size)
        # Open the shard for each access: there may be more shards than allowed open files, and a
        # memory map of a truncated file would crash the process.
        with existing(Path(self.index_path).parent / name, "shard").open("rb") as file:
            file.seek(offset)
            return file.read(size)

    def _table(self, shard: int) -> np.ndarray:
        """The rows of a shard's table, fetched if it is remote, checked and mapped at first use."""
        if shard not in self._tables:
            entry = self.shards[shard]
            name = table_path(entry["path"])
            if self.remote:
                store = store_of(self.scheme)
                address = store.beside(self._base, name.as_posix())
                most = entry["samples"] * SAMPLE.itemsize + MOST_OVERHEAD_BYTES
                with store.fetched(address, most) as path:
                    self._tables[shard] = self._checked_table(path, entry, address)
            else:
                path = Path(self.index_path).parent / name
                self._tables[shard] = self._checked_table(path, entry, str(path))
        return self._tables[shard]

    def _checked_table(self, path: Path, entry: dict, named: str) -> np.ndarray:
        """The rows of a shard's table in a file, checked against the shard's entry of the index.

        named: what a sentence calls the table, since the copy of a remote one is temporary.
        """
        try:
            samples = map_samples(path)
        except InputError as error:
            raise InputError(str(error).replace(str(path), named)) from None
        whole = len(samples) == entry["samples"]
        if not whole or (self.check and sha256(path) != entry["table_sha256"]):
            raise InputError(
                f"{named}: damaged or another table: {len(samples)} rows, expected "
                f"{entry['samples']}, and the SHA-256 that the index states"
            )
        return samples

    def tables(self) -> Iterator[tuple[dict, np.ndarray]]:
        """Yield each shard's entry of the index and its rows, of one shard at a time.

        The rows are those of `sample_table.map_samples`. Memory does not grow with the number of
        shards. Raises: InputError naming a table that is missing or damaged.
        """
        for shard, entry in enumerate(self.shards):
            yield entry, self._table(shard)
            self._tables.pop(shard, None)

    def _locate(self, number: int) -> tuple[int, int]:
        """A sample's shard and its row in the table of that shard."""
        number = int(number)
        if not 0 <= number < len(self):
            raise IndexError(f"sample {number}: expected 0 to {len(self) - 1}")
        shard = int(np.searchsorted(self._ends, number, side="right")) - 1
        return shard, number - int(self._ends[shard])

    def stored(self, number: int, member: str) -> bytes:
        """Return the bytes of a member of a sample, "record" or "data", after the sample's check.

        Raises: InputError naming shard and sample where it is damaged.
        """
        shard, position = self._locate(number)
        row = self._table(shard)[position]
        offset = int(row[f"{member}_offset"])
        size = int(row[f"{member}_size"])
        if self.check:
            sample = self._checked_sample(shard, row)
            start = offset - int(row["offset"])
            return sample[start : start + size]
        # Without a check, read only the member: a record is about 1 % of its sample's bytes.
        content = self._read(shard, offset, size)
        if len(content) < size:
            self._refuse_sample(shard, row)
        return content

    def _checked_sample(self, shard: int, row: np.void) -> bytes:
        """All bytes of the sample of a row in a shard's table, after its check."""
        size = int(row["size"])
        sample = self._read(shard, int(row["offset"]), size)
        if len(sample) < size or hashlib.sha256(sample).digest() != row["sha256"].tobytes():
            self._refuse_sample(shard, row)
        return sample

    def _refuse_sample(self, shard: int, row: np.void) -> NoReturn:
        """Raise InputError naming the shard and the damaged sample."""
        name = Path(self.shards[shard]["path"]).name
        raise InputError(f"{name}: sample {row['key'].decode()} is damaged (SHA-256 differs)")

    def _column(self, name: str) -> np.ndarray:
        """One column of the tables of all shards, (n,)."""
        if not self.shards:
            return np.zeros(0)
        return np.concatenate([self._table(shard)[name] for shard in range(len(self.shards))])

    @functools.cached_property
    def renderer(self) -> Renderer:
        """The renderer that turns the signals of these shards into tiles, as the index says."""
        return Renderer.from_settings(render_blocks(self.index["render"]))

    @property
    def spectra(self) -> tuple[str, ...]:
        """Names of the spectra, in the order of the columns of a tile."""
        return named(self.index["render"]["spectra"])

    @property
    def palette(self) -> np.ndarray:
        """The 256 colours of the index values, (256, 3) uint8."""
        return Images.from_settings(self.index["render"]["images"]).palette

    @property
    def keys(self) -> np.ndarray:
        """Keys of all samples, (n,) bytes."""
        return self._column("key")

    @property
    def labels(self) -> np.ndarray:
        """Labels of all samples, (n,) int64 indices into `classes`, without reading a record."""
        return self._column("label").astype(np.int64)

    @property
    def models(self) -> np.ndarray:
        """Motion model numbers of all samples, (n,) int64, unique within a subtype."""
        return self._column("model").astype(np.int64)

    @property
    def snrs_db(self) -> np.ndarray:
        """SNRs of all samples, (n,) float64."""
        return self._column("snr_db").astype(float)

    def members(self, number: int) -> tuple[bytes, bytes]:
        """Return record and data of a sample as stored.

        Those of a recipe shard are as a signal shard stores them. Raises: InputError naming shard
        and sample where it is damaged.
        """
        if self.kind == "recipe":
            return self._record(number), npy(self.signal(number))
        return self.stored(number, "record"), self.stored(number, "data")

    def _snr_db(self, number: int) -> float:
        """SNR of a sample (dB)."""
        shard, position = self._locate(number)
        return float(self._table(shard)[position]["snr_db"])

    def _record(self, number: int) -> bytes:
        """The JSON record of a sample."""
        stored = self.stored(number, "record")
        if self.kind == "recipe":
            return unpacked(json.loads(stored), self._snr_db(number))
        return stored

    def record(self, number: int) -> dict:
        """Return the JSON record of a sample.

        Raises: InputError naming shard and sample where it is damaged.
        """
        return json.loads(self._record(number))

    def png(self, number: int) -> bytes:
        """Return the PNG file of a sample of an image shard.

        Raises: InputError where shards are of another kind, or naming shard and sample where it is
        damaged.
        """
        self._need("image")
        return self.stored(number, "data")

    def signal(self, number: int) -> np.ndarray:
        """Return the signals of a sample, (stations, symbols) complex64; not of image shards.

        Raises: InputError where these are image shards, or naming shard and sample where it is
        damaged.
        """
        self._need("signal", "recipe", "cube")
        if self.kind == "cube":
            return np.stack([cube.signal for cube in self.cubes(number)])
        stored = complex_signals(self._array(number))
        if self.kind == "signal":
            return stored
        stations = station_names(self.index["render"]["network"])
        entry = json.loads(self.stored(number, "record"))
        return noisy(entry, stored, stations, self._snr_db(number))

    def cubes(self, number: int) -> list[Cube]:
        """Return the cube of each station of a sample of a cube shard.

        Raises: InputError where shards are of another kind, or naming shard and sample where it is
        damaged.
        """
        self._need("cube")
        return cubes_of(self.record(number), self._array(number))

    def _array(self, number: int) -> np.ndarray:
        """The stored array of a sample."""
        return np.lib.format.read_array(io.BytesIO(self.stored(number, "data")))

    def _shown(self, number: int) -> list[Cube] | None:
        """The cubes of a sample if its images need them, else None."""
        if not of_cells(self.spectra):
            return None
        return self.cubes(number)

    def late(self, number: int) -> np.ndarray | None:
        """Return the delays of a sample's symbols, (stations, symbols) intervals.

        They are None if images do not use them.
        """
        render = self.index["render"]
        effects = (self.index.get("echo") or {}).get("effects", {})
        if render["spectra"].get("times") != "known":
            return None
        refuse_effects(effects, self.index_path)
        entry = self.record(number)
        row, _ = row_of(entry)
        return lateness(render["spectra"], effects, self.renderer.network, entry["seed"], row)

    def tile(self, number: int) -> np.ndarray:
        """Return the tile of a sample, (3 S, 3 S) uint8, decoded or rendered.

        All kinds of shards give the same pixels. Raises: InputError naming shard and sample where
        it is damaged.
        """
        if self.kind == "image":
            return decode(self.png(number))[0]
        signal = self.signal(number)
        return self.renderer.tile(signal, late=self.late(number), cubes=self._shown(number))

    def images(
        self,
        number: int,
        size: int | None = None,
        stations: Iterable[str] | None = None,
        views: Iterable[str] | None = None,
    ) -> np.ndarray:
        """Return the images of a sample, (stations spectra, S, S) uint8, station by station.

        size: pixels per side, by the project's one resampling kernel; stations, views: names to
        keep, in their own order (signal and recipe shards then compute nothing else).
        Raises: InputError naming an unknown station or view, or shard and sample where it is
        damaged.
        """
        numbers = self.columns(stations, views)
        if self.kind == "image":
            images = split(self.tile(number), len(self.spectra))[numbers]
        else:
            signal = self.signal(number)
            images = self.renderer.some(signal, numbers, self.late(number), self._shown(number))
        if size in (None, images.shape[-1]):
            return images
        return resize(images, size)

    def columns(
        self, stations: Iterable[str] | None = None, views: Iterable[str] | None = None
    ) -> list[int]:
        """Return the numbers, among all images of a sample, of some stations and views.

        By default they are all stations and all views. Raises: InputError naming an unknown one.
        """
        known = station_names(self.index["render"]["network"])
        spectra = list(self.spectra)
        stations = known if stations is None else list(stations)
        views = spectra if views is None else list(views)
        if set(stations) - set(known) or set(views) - set(spectra):
            raise InputError(
                f"stations {stations} and views {views}, expected some of {known} and of {spectra}"
            )
        numbers = []
        for station in stations:
            first = len(spectra) * known.index(station)
            numbers += [first + spectra.index(view) for view in views]
        return numbers

    def _need(self, *kinds: str) -> None:
        """Raise InputError unless the shards are of one of these kinds."""
        if self.kind not in kinds:
            wanted = " or ".join(map(repr, kinds))
            raise InputError(f"{self.index_path}: shards of kind {self.kind!r}, expected {wanted}")
