"""The echo by its pointwise kernel alone, which has no polynomials: a reference for the fast one and for scenes."""

import numpy as np

from lowalt.echo import refine
from lowalt.echo.api import EchoResult, check_fault, prepared
from lowalt.echo.fast.workspace import Found
from lowalt.echo.pointwise import results


def range_cells(network, station, motion, rcs_m2, aim_m):
    """All range cells (N, M) complex128 (Eq. 25), each by the closed form."""
    scene, radio, refs, aims = prepared(network, station, motion, rcs_m2, aim_m, "")
    cells = np.empty((len(refs), radio.subcarriers), np.complex128)
    check_fault(results.matrix(scene, radio, refs, aims, cells), scene, station, "")
    return cells


def subcarriers(network, station, motion, rcs_m2, aim_m):
    """All subcarriers (N, M) complex128, known symbol removed (Eq. 24)."""
    return np.fft.fft(range_cells(network, station, motion, rcs_m2, aim_m), axis=1)


def signal(network, station, motion, rcs_m2, aim_m):
    """What `echo_signal` returns, with every symbol computed by the pointwise kernel and none rounded again."""
    scene, radio, refs, aims = prepared(network, station, motion, rcs_m2, aim_m, "")
    _, _, method, _ = refine.compute(scene, radio, refs, aims, None)
    found = Found.empty(len(refs))
    symbols = np.arange(len(refs))
    check_fault(results.bounded(scene, radio, refs, symbols, aims, method.pointwise_bound, found), scene, station, "")
    bound = found.bounds.max() / abs(found.values).max()
    ties = int(found.ties.sum())
    return EchoResult(found.values, found.cells, ties, bound, method, found.gaps, found.totals)
