"""Batches of a training: this rank's samples of a step, augmented, as tensors."""

from typing import Any

import numpy as np
import torch
from torch.utils.data import Dataset

from lowalt.numerics.streams import stream
from lowalt.recognition.ahead import tensors
from lowalt.recognition.inference import Machine


class Reader(Dataset):
    """Augmented batches by (step, sample numbers): the map that the loader's workers call."""

    def __init__(self, source, columns: list[int], augmentation: dict, keys: tuple, machine: Machine) -> None:
        """source: samples; columns: their views; augmentation: its settings; keys: seed and names of the stream."""
        self.source, self.columns, self.augmentation, self.keys = source, columns, augmentation, keys
        self.rank, self.ranks = machine.rank, machine.ranks

    def __getitem__(self, item: tuple[int, np.ndarray]) -> tuple[Any, torch.Tensor]:
        """Return this rank's share of a batch: index images (B, views, S, S) uint8, or what else the source gives, and
        labels (B,)."""
        step, numbers = item
        mine = numbers[self.rank :: self.ranks]
        seed, *keys = self.keys
        generator = stream(seed, "recognition-augment", *keys, step, self.rank)
        seen = self.source.changed(mine, self.columns, self.augmentation, generator)
        return tensors(seen), torch.from_numpy(self.source.facts.label[mine]).long()
