"""The compiled loops of the land's echoes: lines of its spectra, and its patches folded into range cells."""

from lowalt.common.jit import LEAN

TOGETHER = 4
"""Symbols that are turned from rows of cells into rows of symbols together."""


@LEAN
def lines(real, imaginary, shape, strong, out):
    """Fill out (cells, K): where strong (K,), the next of real and imaginary times shape (cells or 1, K), else 0."""
    at = 0
    for row in range(len(out)):
        own = shape[row % len(shape)]
        for k in range(len(strong)):
            out[row, k] = 0.0
            if strong[k]:
                out[row, k] = complex(real[at] * own[k], imaginary[at] * own[k])
                at += 1


@LEAN
def folded(lit, still, waves, cells):
    """Add lit[c] (still[c] + waves[c, n]) to cells (N, M) at symbol n in the cell that c (K,) folds into."""
    # A few symbols of all cells at a time stay in the processor's cache.
    for first in range(0, len(cells), TOGETHER):
        for c in range(len(lit)):
            place, x, y = c % cells.shape[1], still[c].real, still[c].imag
            for n in range(first, min(first + TOGETHER, len(cells))):
                cells[n, place] += complex(lit[c] * (waves[c, n].real + x), lit[c] * (waves[c, n].imag + y))
