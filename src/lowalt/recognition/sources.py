"""The one door to samples: caches of views, shards, or a data set that makes them; and the options that name one."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import NamedTuple

from lowalt.files.errors import InputError
from lowalt.recognition.protocols import folds
from lowalt.recognition.samples import Samples, ViewSamples
from lowalt.recognition.schemes import Scheme
from lowalt.recognition.views import ShardSamples
from lowalt.shards import ShardSet


class Source(NamedTuple):
    """Where samples come from, exactly one of three."""

    views: list[str | Path] | None = None
    index: str | Path | None = None
    dataset: str | Path | None = None

    @classmethod
    def of_run(cls, index: Path, size: int) -> "Source":
        """Return a run's caches of views of this size where every shard has one, else its shards (index)."""
        caches = sorted(index.parents[1].glob(f"views/{size}/*.npz"))
        shards = {Path(shard["name"]).stem for shard in ShardSet(index).index["shards"]}
        return cls(views=caches) if {path.stem for path in caches} == shards else cls(index=index)

    @classmethod
    def of_options(cls, options: Namespace) -> "Source":
        """Return the source that a command line names (`add_options`).

        Raises: InputError where it names none or several.
        """
        source = cls(options.views, options.index, options.dataset)
        if sum(place is not None for place in source) != 1:
            raise InputError("expected one of --views, --index and --dataset")
        return source

    @staticmethod
    def add_options(line: ArgumentParser) -> None:
        """Add the options that name samples."""
        line.add_argument("--views", nargs="+", help="caches of views (.npz)")
        line.add_argument("--index", help="instead of --views: index of the shards, read sample by sample")
        line.add_argument("--dataset", help="instead of both: config.yaml of a run with clouds, whose samples are made")

    def samples(self, columns: list[int], pairs: set[tuple[str, str]], size: int, placed: bool = False) -> Samples:
        """Return the samples of some (group, fold) pairs.

        columns: views of a scheme (`Scheme.columns`); size: pixels a side; placed: whether the facts of shards and data
        sets carry ranges and aspects.
        Raises: InputError for cached images of another size, or what the source refuses.
        """
        if self.dataset is not None:
            # Only this source needs the simulation, whose import takes longer than reading a cache.
            from lowalt.recognition.made import DatasetSamples, opened

            return DatasetSamples(opened(self.dataset), columns, pairs, size, placed)
        if self.views is None:
            return ShardSamples(self.index, columns, pairs, size, placed)
        cached = ViewSamples(self.views, columns, pairs)
        if cached.size != size:
            raise InputError(f"--views: images of {cached.size} pixels, expected {size}")
        return cached

    def for_training(self, scheme: Scheme, protocol: str, size: int) -> dict[str, Samples]:
        """Return the samples of a protocol's parts "train" and "validation" as a scheme sees them."""
        return {part: self.samples(scheme.columns, folds(protocol, part), size) for part in ("train", "validation")}
