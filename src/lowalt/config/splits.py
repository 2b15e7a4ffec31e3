"""The fold of a sample (train, val or test), which depends only on the sample's name.

Models are assigned in blocks: every block of `train + val + test` consecutive model numbers of a
subtype is shuffled by its own stream and divided into the three shares. Full blocks therefore have
exact shares, and added models, subtypes or SNRs do not change existing folds.
"""

import functools

from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream

FOLDS = ("train", "val", "test")
WAYS = ("motion", "sample")


@functools.lru_cache(maxsize=65536)
def _block(shares: tuple[int, int, int], seed: int, keys: tuple, number: int) -> tuple[str, ...]:
    """Folds of the models in one block, by their position in it."""
    names: list[str] = []
    for name, share in zip(FOLDS, shares, strict=True):
        names += [name] * share
    order = stream(seed, "fold", *keys, number).permutation(len(names))
    return tuple(names[index] for index in order)


def fold(split: dict, seed: int, subtype: str, model: int, snr_db: float | None = None) -> str:
    """Return the fold ("train", "val" or "test") of one sample.

    split: the configuration's block, `by` ("motion": all SNRs of a motion model share its fold,
    nothing leaks; "sample": the paper's way, each SNR assigned separately) and the whole-number
    shares `train`, `val`, `test` of a block. model: number of the motion model, which all looks of
    a track share. snr_db matters only for "sample".
    Raises: InputError naming the key that is wrong. Source: paper, section V-A.
    """
    shares = tuple(split[name] for name in FOLDS)
    if any(not isinstance(share, int) or share < 0 for share in shares) or shares[0] < 1:
        raise InputError(
            f"split: shares {dict(zip(FOLDS, shares, strict=True))}, expected whole numbers, "
            "train >= 1"
        )
    if split["by"] == "motion":
        keys: tuple[str, ...] = (subtype,)
    elif split["by"] == "sample":
        if snr_db is None:
            raise InputError("split: by 'sample' needs the SNR of the sample")
        keys = (subtype, "snr", str(float(snr_db)))
    else:
        raise InputError(f"split: by is {split['by']!r}, expected one of {WAYS}")
    size = sum(shares)
    return _block(shares, seed, keys, model // size)[model % size]
