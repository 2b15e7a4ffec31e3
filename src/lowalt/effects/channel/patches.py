"""Patches of land: where they stand in their range cells, which gives them side lobes, and how alike neighbours are.

Land fills every cell from edge to edge, and what stands off a cell's centre has range side lobes in all others. A patch
a quarter of a cell off the centre has the mean side lobes of land spread over a whole cell: sin^2 of pi times the
offset is then 1/2, its mean. So the land's rings are centred a quarter of a cell beyond the cells' centres.
"""

import numpy as np
from scipy.special import ndtr, ndtri

OFFSET = 0.25
"""Distance of a patch from the centre of its range cell, in cells."""


def ramp(subcarriers: int) -> np.ndarray:
    """Return the phase (M,) of the offset at every subcarrier."""
    return np.exp(-2j * np.pi * OFFSET * np.arange(subcarriers) / subcarriers)


def with_side_lobes(power: np.ndarray, subcarriers: int) -> np.ndarray:
    """Return the mean power (M,) in the M range cells of patches of independent phase with `power` (cells,)."""
    lobe = abs(np.fft.ifft(ramp(subcarriers))) ** 2
    folded = np.zeros(-(-len(power) // subcarriers) * subcarriers)
    folded[: len(power)] = power
    folded = folded.reshape(-1, subcarriers).sum(axis=0)
    return np.fft.ifft(np.fft.fft(folded) * np.fft.fft(lobe)).real


def alike(uniform: np.ndarray, correlation: float) -> np.ndarray:
    """Return uniforms (2, cells) of which neighbours are alike: their normal scores correlate by `correlation`^lag.

    Each keeps its law, so textures made from them do too. Source: memoryless non-linear transform, Tough & Ward, The
    correlation properties of gamma and other non-Gaussian processes, J. Phys. D 32, 1999.
    """
    if correlation == 0:
        return uniform
    # The report explains scenes by the laws of this folder, and scipy.signal takes a second to import.
    from scipy.signal import lfilter

    score = ndtri(uniform)
    score[:, 1:] *= np.sqrt(1 - correlation**2)
    return ndtr(lfilter([1.0], [1.0, -correlation], score, axis=1))
