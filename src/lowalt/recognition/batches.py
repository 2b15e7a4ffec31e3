"""The batches of training and evaluation: the order of samples, and processes that read ahead.

The order depends only on seed and epoch, so an interrupted training resumes at any step. Workers
start once and live as long as their reader, not once per epoch.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import torch
from torch.utils.data import DataLoader, Dataset

from lowalt.numerics.streams import stream
from lowalt.recognition.samples import Facts, Samples


def epoch_order(
    facts: Facts, seed: int, keys: tuple, epoch: int, snrs_per_model: int
) -> np.ndarray:
    """Return the sample numbers of one epoch, shuffled.

    snrs_per_model: how many randomly chosen SNRs of each motion model the epoch visits; 0 visits
    all. Fewer give more epochs of distinct motion for the same time, since SNRs of one motion model
    are nearly the same image.
    """
    generator = stream(seed, "recognition-order", *keys, epoch)
    draw = generator.random(len(facts))
    order = np.argsort(draw, kind="stable")
    if not snrs_per_model:
        return order
    _, motion = np.unique(facts.motion, return_inverse=True)
    # Rank the samples within each motion model by their draw; keep the first `snrs_per_model`.
    grouped = order[np.argsort(motion[order], kind="stable")]
    starts = np.concatenate([[0], np.cumsum(np.bincount(motion))[:-1]])
    rank = np.empty(len(facts), dtype=np.int64)
    rank[grouped] = np.arange(len(facts)) - starts[motion[grouped]]
    return order[rank[order] < snrs_per_model]


def batches(order: np.ndarray, size: int) -> list[np.ndarray]:
    """Cut an epoch's order into full batches, or one shorter batch if there is no full one."""
    full = len(order) // size
    if full == 0:
        return [order]
    return [order[start * size : (start + 1) * size] for start in range(full)]


def tensors(arrays: Any) -> Any:
    """Return an array, or every array of a named tuple, as a tensor."""
    if isinstance(arrays, tuple):
        return type(arrays)(*map(torch.from_numpy, arrays))
    return torch.from_numpy(arrays)


class Unchanged(Dataset):
    """The map from sample numbers to a batch that evaluation reads: index images as they are."""

    def __init__(self, source: Samples) -> None:
        """Take the samples."""
        self.source = source

    def __getitem__(self, numbers: np.ndarray) -> Any:
        """Return the inputs of the network for the samples `numbers` as tensors."""
        return tensors(self.source.inputs(numbers))


class Augmented(Dataset):
    """Augmented batches of a training by (step, sample numbers)."""

    def __init__(
        self, source: Samples, columns: list[int], block: dict, keys: tuple, rank: int, ranks: int
    ) -> None:
        """Take the samples and how they are changed.

        columns: views of the samples; block: `recognition.augmentation`; keys: seed and names of
        the random stream; rank, ranks: the share of each batch that is read here.
        """
        self.source = source
        self.columns = columns
        self.block = block
        self.keys = keys
        self.rank = rank
        self.ranks = ranks

    def __getitem__(self, item: tuple[int, np.ndarray]) -> tuple[Any, torch.Tensor]:
        """Return this rank's share of a batch, and its labels (B,).

        It holds index images (B, views, S, S) uint8, or what else the source gives.
        """
        step, numbers = item
        mine = numbers[self.rank :: self.ranks]
        seed, *names = self.keys
        generator = stream(seed, "recognition-augment", *names, step, self.rank)
        changed = self.source.changed(mine, self.columns, self.block, generator)
        return tensors(changed), torch.from_numpy(self.source.facts.label[mine]).long()


class Prefetch:
    """Calls a map for one item after the other, in worker processes if there are any, in order."""

    def __init__(self, read: Dataset, workers: int, pin: bool) -> None:
        """read: map from an item to a batch; workers: processes that call it, 0 for this one; pin:
        whether batches go to memory from which a GPU copies."""
        self._items: list = []
        self._loader = DataLoader(
            read,
            sampler=self._items,
            batch_size=None,
            num_workers=workers,
            persistent_workers=workers > 0,
            pin_memory=pin,
            # A generator of its own: the loader must not draw from the stream that dropout draws
            # from.
            generator=torch.Generator(),
        )

    def __call__(self, items: Sequence) -> Iterator:
        """Return the batches of these items; the workers drop batches of an earlier call."""
        # The loader keeps this very list, and asks it for items anew at every pass.
        self._items[:] = items
        return iter(self._loader)
