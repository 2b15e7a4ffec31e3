"""Batches of a training and an evaluation, read ahead by workers that live as long as their reader: they start once,
not once an epoch."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import torch
from torch.utils.data import DataLoader, Dataset

from lowalt.numerics.streams import stream
from lowalt.recognition.samples import Samples


def tensors(arrays: Any) -> Any:
    """Return an array, or every array of a named tuple, as a tensor."""
    return type(arrays)(*map(torch.from_numpy, arrays)) if isinstance(arrays, tuple) else torch.from_numpy(arrays)


class Unchanged(Dataset):
    """Index images of samples as they are: the map from sample numbers to a batch that evaluation reads."""

    def __init__(self, source: Samples) -> None:
        """Take the samples."""
        self.source = source

    def __getitem__(self, numbers: np.ndarray) -> Any:
        """Return the inputs of the network for the samples `numbers` as tensors."""
        return tensors(self.source.inputs(numbers))


class Augmented(Dataset):
    """Augmented batches of a training by (step, sample numbers)."""

    def __init__(self, source: Samples, columns: list[int], block: dict, keys: tuple, rank: int, ranks: int) -> None:
        """columns: views of the samples; block: `recognition.augmentation`; keys: seed and names of the random stream;
        rank, ranks: the share of each batch that is read here."""
        self.source, self.columns, self.block, self.keys, self.rank, self.ranks = (
            source, columns, block, keys, rank, ranks
        )  # fmt: skip

    def __getitem__(self, item: tuple[int, np.ndarray]) -> tuple[Any, torch.Tensor]:
        """Return this rank's share of a batch: index images (B, views, S, S) uint8, or what else the source gives, and
        labels (B,)."""
        step, numbers = item
        mine = numbers[self.rank :: self.ranks]
        seed, *names = self.keys
        generator = stream(seed, "recognition-augment", *names, step, self.rank)
        changed = self.source.changed(mine, self.columns, self.block, generator)
        return tensors(changed), torch.from_numpy(self.source.facts.label[mine]).long()


class Prefetch:
    """Calls a map for one item after the other, in worker processes where there are any, and keeps their order."""

    def __init__(self, read: Dataset, workers: int, pin: bool) -> None:
        """read: map from an item to a batch; workers: processes that call it, 0 for this one; pin: whether batches go
        to memory from which a GPU copies."""
        self._items: list = []
        self._loader = DataLoader(
            read, sampler=self._items, batch_size=None, num_workers=workers, persistent_workers=workers > 0,
            pin_memory=pin,
            # A generator of its own: the loader must not draw from the stream that dropout draws from.
            generator=torch.Generator(),
        )  # fmt: skip

    def __call__(self, items: Sequence) -> Iterator:
        """Return the batches of these items; the workers drop batches of an earlier call."""
        # The loader keeps this very list, and asks it for items anew at every pass.
        self._items[:] = items
        return iter(self._loader)
