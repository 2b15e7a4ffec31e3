"""Batches of a training: this rank's samples of a step, augmented, as tensors."""

import numpy as np
import torch
from torch.utils.data import Dataset

from lowalt.common.streams import stream
from lowalt.recognition.augment import augment
from lowalt.recognition.augment_signals import augment_signals
from lowalt.recognition.height_cue import WithHeight, measured
from lowalt.recognition.inference import Machine


class Reader(Dataset):
    """Augmented batches by (step, sample numbers): the map that the loader's workers call."""

    def __init__(self, source, columns: list[int], augmentation: dict, keys: tuple, machine: Machine) -> None:
        """source: samples; columns: their views; augmentation: its settings; keys: seed and names of the stream."""
        self.source, self.columns, self.augmentation, self.keys = source, columns, augmentation, keys
        self.rank, self.ranks = machine.rank, machine.ranks

    def __getitem__(self, item: tuple[int, np.ndarray]) -> tuple[torch.Tensor | WithHeight, torch.Tensor]:
        """Return this rank's share of a batch: index images (B, views, S, S) uint8, or signals (B, stations, N)
        complex64, perhaps with heights, and labels (B,)."""
        step, numbers = item
        mine = numbers[self.rank :: self.ranks]
        seed, *keys = self.keys
        generator = stream(seed, "recognition-augment", *keys, step, self.rank)
        seen = self.source.views(mine)
        if np.iscomplexobj(seen):
            seen = augment_signals(seen, self.augmentation, generator)
        else:
            seen = augment(seen, self.columns, self.augmentation, generator)
        # A source with a stream knows labels of samples that are not among its facts.
        told = getattr(self.source, "labels", self.source.facts.label.__getitem__)(mine)
        return measured(self.source, mine, torch.from_numpy(seen)), torch.from_numpy(told).long()
