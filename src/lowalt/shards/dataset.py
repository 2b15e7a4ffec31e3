"""A data set that simulates each sample on access, with the same bytes as in the shards.

Torch is not imported: `Dataset` has a length and indexed samples, as `torch.utils.data.DataLoader`
expects, and `Endless` is an iterable. Both can be pickled, so the workers of any framework can make
samples.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lowalt.config.blocks import motion_block, render_blocks
from lowalt.config.brought import OF_TRAINING, refuse_brought
from lowalt.config.layers import SCHEMA, check
from lowalt.config.network import masts_m
from lowalt.config.splits import FOLDS
from lowalt.files.errors import InputError, warn
from lowalt.files.shipped import located, shipped
from lowalt.files.yaml_files import load_yaml
from lowalt.motion.drawing import region_polygon
from lowalt.motion.track_files import path_of
from lowalt.motion.tracks import model_rows
from lowalt.scene.effects import complete, needs_surfaces, of_record
from lowalt.shards.maker import Maker
from lowalt.shards.plan import GROUPS, Plan
from lowalt.shards.remake import CloudFolder
from lowalt.shards.sample_list import Place, SampleList
from lowalt.shards.sample_record import accompanied, record
from lowalt.shards.sizes import cell_type
from lowalt.spectra.cube import Cube
from lowalt.targets.cloud import Cloud
from lowalt.targets.records import missing_inputs, records_of


class Sample(NamedTuple):
    """One sample: `image`, its tile of index values, `signal`, and `record`, as in the shards.

    image: (3 S, 3 S) uint8; signal: (stations, symbols) complex64; record: a dict.
    """

    image: np.ndarray
    signal: np.ndarray
    record: dict


class MadeOnDemand(Mapping):
    """The result of `make` for each target's record, by subtype, computed on first access."""

    def __init__(
        self, make: Callable[..., Any], records: dict[str, dict], seed: int, inputs: Path | None
    ) -> None:
        """make: a function of (record, inputs, seed); inputs: the user's folder of meshes and
        recordings, or None.
        """
        self._make = make
        self._records = records
        self._sources = (inputs, seed)
        self._made: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        """The result for one target, kept once it is made.

        Raises: KeyError for another name; InputError where its record or input is wrong.
        """
        if name not in self._made:
            self._made[name] = self._make(self._records[name], *self._sources)
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._records)

    def __len__(self) -> int:
        return len(self._records)


def made_cloud(record: dict, inputs: Path | None, seed: int) -> Cloud:
    """Return the cloud of a record, made from the source that it names.

    Raises: InputError where the record or an input is wrong.
    """
    from lowalt.targets.make import make

    return make(record, inputs, seed)


def made_surfaces(record: dict, inputs: Path | None, seed: int) -> dict:
    """Return the surfaces of a record, made from the source that it names.

    Raises: InputError where the record or an input is wrong, or the target has no surfaces.
    """
    from lowalt.targets.occluders import make

    return make(record, inputs, seed) | {"subtype": record["subtype"]}


class Dataset:
    """The samples of a configuration by number: by group, then model, then subtype, then SNR.

    A crow's first second, at 3 dB:

        >>> from lowalt.config.layers import overlaid
        >>> config = overlaid(["config/tiny.yaml"])
        >>> config["targets"]["select"] = ["Crow"]
        >>> samples = Dataset(config)
        >>> image, signal, record = samples[0]
        >>> len(samples), image.shape, signal.shape, record["snr_db"]
        (20, (768, 768), (3, 400), 3.0)
        >>> samples.classes[samples.labels[0]]
        'Bird'
    """

    def __init__(
        self,
        config: dict | str | Path,
        clouds: Mapping[str, Cloud] | str | Path | None = None,
        groups: Iterable[str] = GROUPS,
        folds: Iterable[str] = FOLDS,
        inputs: str | Path | None = None,
        occluders: Mapping[str, dict] | None = None,
        published: dict[str, dict] | None = None,
        records: dict[str, dict] | None = None,
    ) -> None:
        """Take a merged configuration or the path of one, and choose groups and folds.

        config: the configuration, or a path such as results/RUN/config.yaml. clouds: the clouds by
        subtype, or the folder of their files; by default they are made here, from the records that
        the configuration names and the folder `inputs` of meshes and recordings, each when it is
        first asked for.
        occluders: each subtype's surfaces, for effects that need them; by default made here if
        the clouds are.
        published: the row of each subtype in the table of targets, which decides the classes; by
        default the records'.
        records: the merged records of all targets; by default read from the configuration's files.
        Raises: InputError naming the key, value or file that is wrong.
        """
        if isinstance(config, (str, Path)):
            path = config
            config = check(load_yaml(config), shipped(SCHEMA))
            # The folder of inputs is an argument here, and no network is trained.
            unused = ("inputs", *OF_TRAINING)
            refuse_brought({key: config[key] for key in config if key not in unused}, path)
        self.config = config
        if records is None and (published is None or clouds is None):
            # A run's configuration names tables and records as seen from the checkout it was made
            # in.
            records = records_of(located(config)["targets"], inputs)
        records = records or {}
        self.published = published or {name: item["published"] for name, item in records.items()}
        self.plan = Plan.of(config, self.published)
        self.listed = SampleList(self.plan, self.published, groups, folds)
        self.classes = self.listed.classes
        self.groups = self.listed.groups
        self.folds = self.listed.folds
        subtypes: list[str] = []
        for group in self.groups:
            subtypes += self.plan.groups[group]
        if clouds is None:
            wanted = {name: records[name] for name in subtypes}
            folder = Path(inputs) if inputs else None
            missing = missing_inputs(wanted, folder)
            if missing:
                raise InputError("missing inputs:\n  " + "\n  ".join(missing))
            clouds = MadeOnDemand(made_cloud, wanted, config["seed"], folder)
            if occluders is None and needs_surfaces(config["effects"]):
                occluders = MadeOnDemand(made_surfaces, wanted, config["seed"], folder)
        if not isinstance(clouds, Mapping):
            clouds = CloudFolder(clouds)
        self.clouds = clouds
        self._masts = np.array(masts_m(config["network"]), float)
        self._corners = region_polygon(self._masts, config["motion"]["region"]["polygon_m"])
        self._motion = motion_block(located(config))
        self._path = path_of(self._motion, self._corners, self._masts)
        self._track: tuple[str, int] | None = None
        self._track_rows: list[dict] = []
        render = render_blocks(config)
        echo = {"tolerance": config["echo"]["tolerance"], "effects": config["effects"]}
        self._recorded = complete(of_record(config["effects"]))
        self.maker = Maker(render, echo, config["seed"], self.clouds, occluders)
        chosen = [self.published[name] for name in subtypes]
        network = self.maker.network
        texts = network.folding(chosen), network.range_folding(self._corners)
        self.folding = tuple(text for text in texts if text)
        """Warnings that speeds or ranges fold."""
        for text in self.folding:
            warn(text)

    def __len__(self) -> int:
        return len(self.listed)

    def place(self, number: int) -> Place:
        """Return group, subtype, motion model and SNR of a sample.

        Raises: IndexError where there is no sample of this number.
        """
        return self.listed[number]

    def place_of(self, subtype: str, model: int, snr_db: float) -> Place:
        """Return the place of any motion model of a subtype at any SNR (dB).

        Raises: InputError for a subtype that is not selected.
        """
        return self.listed.named(subtype, model, snr_db)

    def row(self, place: Place) -> dict:
        """Return the motion table's row of a sample, also of models beyond the configuration's."""
        track, look = divmod(place.model, self.plan.looks)
        # All looks of a track are drawn together and usually accessed in sequence, so keep the last
        # track.
        if self._track != (place.subtype, track):
            self._track_rows = model_rows(
                self.plan.seed,
                self.clouds[place.subtype],
                self.published[place.subtype],
                self._masts,
                self._corners,
                self._motion,
                track,
                self._path,
            )
            self._track = (place.subtype, track)
        row = {**self._track_rows[look], "group": place.group, "model": place.model}
        return accompanied(row, self._recorded, self.plan.seed, self.maker.network)

    def made_signal(self, place: Place) -> np.ndarray:
        """Return the noisy signals of a sample, (stations, symbols) complex64."""
        return self.maker.signal(self.row(place), place.snr_db)

    def made_record(self, place: Place, cubes: dict | None = None) -> bytes:
        """Return the JSON record of a sample; cubes: what it says of each station's cube."""
        return record(
            self.row(place),
            place.snr_db,
            self.listed.fold(place),
            self.plan.seed,
            self.maker.network,
            self.classes,
            cubes,
        )

    def made(self, place: Place) -> Sample:
        """Return a sample by its group, subtype, motion model and SNR.

        Raises: InputError naming the sample that cannot be computed.
        """
        signal = self.made_signal(place)
        image = self.maker.tile(signal, self.row(place), place.snr_db)
        return Sample(image, signal, json.loads(self.made_record(place)))

    def __getitem__(self, number: int) -> Sample:
        return self.made(self.place(number))

    def key(self, number: int) -> str:
        """Return the key of a sample, as in the shards."""
        return self.place(number).key

    @property
    def labels(self) -> np.ndarray:
        """Labels of all samples, (n,) int64 indices into `classes`; no sample is simulated."""
        return self.listed.labels

    def signal(self, number: int) -> np.ndarray:
        """Return the noisy signals of a sample, (stations, symbols) complex64."""
        return self.made_signal(self.place(number))

    def record(self, number: int) -> dict:
        """Return the record of a sample."""
        return json.loads(self.made_record(self.place(number)))

    def members(self, number: int, kind: str) -> tuple[bytes, bytes]:
        """Return record and data of a sample, byte for byte as a shard of a kind holds them.

        kind: "image", "cube", or "signal" and "recipe", which hold the same.
        """
        place = self.place(number)
        row = self.row(place)
        signal = self.made_signal(place)
        data, cubes = self.maker.data(kind, signal, row, place.snr_db, cell_type(self.config))
        return self.made_record(place, cubes), data

    def cubes(self, number: int) -> list[Cube]:
        """Return the cube of each station of a sample: noisy range cells, chosen ones, truth."""
        place = self.place(number)
        return self.maker.cubes(self.row(place), place.snr_db, self.made_signal(place))

    def tile(self, number: int) -> np.ndarray:
        """Return the tile of a sample, (3 S, 3 S) uint8 index values."""
        return self[number].image


class Endless:
    """An endless sequence of samples: all subtypes at all SNRs, model after model.

    With `parts` workers or ranks, number `part` takes every `parts`-th motion model, so that no
    sample is made twice.
    """

    def __init__(
        self, dataset: Dataset, first: int | None = None, part: int = 0, parts: int = 1
    ) -> None:
        """Begin at model `first`; the default is the first model after those of the configuration.

        Raises: InputError where the part is not below the number of parts.
        """
        if not 0 <= part < parts:
            raise InputError(f"part {part} of {parts}, expected 0 <= part < parts")
        self.dataset = dataset
        self.part = part
        self.parts = parts
        self.first = dataset.plan.models if first is None else first

    def places(self) -> Iterator[Place]:
        """Yield the name of each sample in turn; no sample is made."""
        return self.dataset.listed.models_from(self.first + self.part, self.parts)

    def __iter__(self) -> Iterator[Sample]:
        return map(self.dataset.made, self.places())
