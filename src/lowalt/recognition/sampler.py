"""The order of samples in an epoch: a function of seed and epoch alone, so a run resumes anywhere."""

import numpy as np

from lowalt.numerics.streams import stream
from lowalt.recognition.samples import Facts


def epoch_order(facts: Facts, seed: int, keys: tuple, epoch: int, snrs_per_model: int) -> np.ndarray:
    """Return the sample numbers of one epoch, shuffled.

    snrs_per_model: how many randomly chosen SNRs of each motion model the epoch visits; 0 visits all. Fewer give
    more epochs of distinct motion for the same time, since SNRs of one motion model are nearly the same image.
    """
    generator = stream(seed, "recognition-order", *keys, epoch)
    draw = generator.random(len(facts))
    order = np.argsort(draw, kind="stable")
    if not snrs_per_model:
        return order
    _, motion = np.unique(np.char.add(np.char.add(facts.subtype, "\n"), facts.model.astype(str)), return_inverse=True)
    # Rank of each sample among its motion model's: the first few by the draw stay.
    grouped = order[np.argsort(motion[order], kind="stable")]
    starts = np.concatenate([[0], np.cumsum(np.bincount(motion))[:-1]])
    rank = np.empty(len(facts), dtype=np.int64)
    rank[grouped] = np.arange(len(facts)) - starts[motion[grouped]]
    return order[rank[order] < snrs_per_model]


def batches(order: np.ndarray, size: int) -> list[np.ndarray]:
    """Cut an epoch's order into full batches; a shorter last one is left out unless it is the only one."""
    full = len(order) // size
    if full == 0:
        return [order]
    return [order[start * size : (start + 1) * size] for start in range(full)]
