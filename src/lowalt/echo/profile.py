"""Range profile of a target over slow time: the range cells around the strongest one, symbol by symbol."""

from typing import NamedTuple

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.echo.api import check_fault, echo_signal, prepared
from lowalt.echo.pointwise.profile_cells import profile_cells
from lowalt.echo.scene import Rigid, Target
from lowalt.files.errors import InputError


class Profile(NamedTuple):
    """values: (N, cells) complex128, ascending in range, the strongest cell in the middle; cell: (N,) int64, its index
    in 0 .. M-1. Cells below 0 and from M on are those at the other end, as in the inverse DFT."""

    values: np.ndarray
    cell: np.ndarray


def range_profile(
    network: Network,
    station: Station,
    motion: Rigid | Target | np.ndarray,
    rcs_m2: np.ndarray | float | None,
    aim_m: np.ndarray,
    cells: int,
    sample: str = "",
) -> Profile:
    """Return the range profile of a target at `station`, `cells` range cells of c / (2 M df) metres each.

    The middle cell is the strongest of all M, as `echo_signal` finds it, so it holds the echo's signal. Other arguments
    and errors as for `echo_signal`; InputError also for `cells` that is even, below 1 or above M.
    Source: paper, Eqs. 7, 24 and 25; high-resolution range profiles of UAVs and birds: AirGuard, arXiv 2603.13112.
    """
    count = network.subcarriers
    if isinstance(cells, bool) or not isinstance(cells, (int, np.integer)) or cells % 2 == 0 or not 1 <= cells <= count:
        raise InputError(f"profile: {cells!r} cells, expected an odd number from 1 to the {count} of the band")
    tracked = echo_signal(network, station, motion, rcs_m2, aim_m, sample=sample).cell
    scene, radio, refs, aims, _ = prepared(network, station, motion, rcs_m2, aim_m, None, sample)
    reach = max(min(2 * cells, (count - 1) // 2), 0)
    steps = np.arange(-reach, reach + 1)
    signs, angles = 1.0 - 2.0 * (steps % 2), np.pi * steps / count
    out = np.empty((len(refs), cells), np.complex128)
    fault = profile_cells(scene, radio, refs, aims, tracked, signs * np.sin(angles), signs * np.cos(angles), out)
    check_fault(fault, scene, station, sample)
    return Profile(out, tracked)
