"""The order in which a training run reads samples: shuffled by (seed, epoch), shared by ranks, resumed anywhere.

No torch here: a `Batches` is an iterable of lists of sample numbers, which is what `torch.utils.data.DataLoader`
takes as `batch_sampler` beside a map-style data set. Workers only fetch what it hands out, so their number changes
nothing.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.streams import stream


@dataclass(frozen=True)
class Batches:
    """The batches of one rank in one epoch: `batch` samples a rank of `count` samples in all.

    All ranks take their shares of one permutation, drawn from (seed, epoch) alone, so an epoch has every sample
    exactly once whatever the ranks and the batch. `start` is the number of samples that all ranks together have
    done; it may have been reached with other ranks or batches. Every rank has equally many batches; the last may
    be smaller, or on some ranks one or more samples larger, than the others.
    Raises: InputError where a number is out of range.
    """

    count: int
    batch: int
    seed: int
    epoch: int = 0
    ranks: int = 1
    rank: int = 0
    start: int = 0

    def __post_init__(self) -> None:
        good = self.count >= 0 and self.batch >= 1 and 0 <= self.rank < self.ranks and 0 <= self.start <= self.count
        if not good or self.epoch < 0:
            raise InputError(f"loader: {self}, expected batch >= 1, rank < ranks, 0 <= start <= count, epoch >= 0")

    @property
    def order(self) -> np.ndarray:
        """The whole epoch's permutation of the sample numbers, (count,) int64."""
        return stream(self.seed, "loader", self.epoch).permutation(self.count)

    def _bounds(self) -> list[int]:
        """Where in the order the steps of all ranks together begin and end."""
        bounds = [*range(self.start, self.count, self.batch * self.ranks), self.count]
        # A last step with fewer samples than ranks would leave a rank without one; it joins the step before.
        if len(bounds) > 2 and bounds[-1] - bounds[-2] < self.ranks:
            del bounds[-2]
        return bounds

    def __len__(self) -> int:
        return len(self._bounds()) - 1

    def __iter__(self) -> Iterator[list[int]]:
        order, bounds = self.order, self._bounds()
        for first, last in itertools.pairwise(bounds):
            yield order[first + self.rank : last : self.ranks].tolist()

    def resumed(self, done: int) -> "Batches":
        """Return what is left after this rank (and so every rank) has finished `done` of these batches.

        Raises: InputError where there are fewer batches than that.
        """
        if not 0 <= done <= len(self):
            raise InputError(f"loader: {done} batches done, expected 0 to {len(self)}")
        return replace(self, start=self._bounds()[done])

    def next_epoch(self) -> "Batches":
        """Return the whole of the next epoch."""
        return replace(self, epoch=self.epoch + 1, start=0)
