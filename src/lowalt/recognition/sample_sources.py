"""Where training and evaluation read samples: caches of views, shards, or simulation on access."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from lowalt.files.errors import InputError
from lowalt.recognition.protocols import folds
from lowalt.recognition.samples import Samples, ViewSamples
from lowalt.recognition.schemes import Scheme
from lowalt.recognition.views import ShardSamples
from lowalt.shards import ShardSet


@dataclass(frozen=True)
class Source:
    """One of three sources: caches of views, the index of shards, or a function that simulates.

    made: the function, with the arguments of `samples`. The caller imports it, so that reading
    stored samples does not import the simulation.
    """

    views: Sequence[str | Path] | None = None
    index: str | Path | None = None
    made: Callable[..., Samples] | None = None

    @classmethod
    def of_run(cls, index: Path, size: int) -> "Source":
        """Return a run's caches of views of this size if every shard has one, else its index."""
        caches = sorted(index.parents[1].glob(f"views/{size}/*.npz"))
        shards = {Path(shard["name"]).stem for shard in ShardSet(index).index["shards"]}
        return cls(views=caches) if {path.stem for path in caches} == shards else cls(index=index)

    def samples(
        self, columns: list[int], pairs: set[tuple[str, str]], size: int, placed: bool = False
    ) -> Samples:
        """Return the samples of some (group, fold) pairs.

        columns: views of a scheme (`Scheme.columns`); size: pixels per side; placed: whether facts
        carry ranges and aspects, which those of a cache always do.
        Raises: InputError for cached images of another size, or what the source refuses.
        """
        if self.made is not None:
            return self.made(columns, pairs, size, placed)
        if self.index is not None:
            return ShardSamples(self.index, columns, pairs, size, placed)
        cached = ViewSamples(self.views or (), columns, pairs)
        if cached.size != size:
            raise InputError(f"--views: images of {cached.size} pixels, expected {size}")
        return cached

    def for_training(self, scheme: Scheme, protocol: str, size: int) -> dict[str, Samples]:
        """Return a protocol's samples of "train" and of "validation" as a scheme sees them."""
        return {
            part: self.samples(scheme.columns, folds(protocol, part), size)
            for part in ("train", "validation")
        }
