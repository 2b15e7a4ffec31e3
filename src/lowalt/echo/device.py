"""The cell signal on a torch device, in float64: equal to the exact mode to rounding, with all range cells computed.

The reference ranges are computed on the processor (double-double, once a symbol). The rest is the pointwise kernel of
`terms` in arrays of (symbols, points), a few range cells at a time. It uses no polynomials and gives no error bound.
"""

import math

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.network import Network, Station
from lowalt.echo.pointwise.reference_range import CELL, RANGE, REST, TURN, reference
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import Radar, radar
from lowalt.echo.scene import check

LARGEST_ARRAY = 2**23
"""Most numbers in a work array; it sets how many cells are computed at a time."""


def _dirichlet(torch, x, count: int):
    """Return sin(pi count x) / sin(pi x) with its limits at whole x; both arguments are reduced before pi comes in.

    `terms.dirichlet` for torch tensors, which no compiled function takes.
    """
    whole = torch.round(x)
    part = x - whole
    many = count * part
    turns = torch.round(many)
    top = torch.sin(math.pi * (many - turns)) * (1 - 2 * torch.remainder(turns, 2))
    at_limit = part == 0
    ratio = torch.where(at_limit, float(count), top / torch.where(at_limit, 1.0, torch.sin(math.pi * part)))
    return ratio if count % 2 else ratio * (1 - 2 * torch.remainder(whole, 2))


def _terms(torch, radio: Radar, refs, e, root_rcs, aims: tuple[float, float]):
    """Return amplitudes z (N, L) complex and ranges u (N, L) in cells from the reference's cell; see `terms.terms`."""
    d = refs[:, None, :3] + e
    square = (d * d).sum(dim=2)
    r = torch.sqrt(square)
    more = (e * (2 * refs[:, None, :3] + e)).sum(dim=2) / (r + refs[:, None, RANGE])
    psi = (radio.cosine * d[..., 1] - radio.sine * d[..., 0]) / r - aims[0]
    omega = d[..., 2] / r - aims[1]
    gain = radio.scale * root_rcs / square
    for cosine, counts in ((psi, (radio.transmit_h, radio.receive_h)), (omega, (radio.transmit_v, radio.receive_v))):
        for count in counts:
            gain = gain * _dirichlet(torch, 0.5 * radio.kappa * cosine, count)
    turn = radio.kappa / 4 * (radio.transmit_h + radio.receive_h - 2) * psi
    turn = turn + radio.kappa / 4 * (radio.transmit_v + radio.receive_v - 2) * omega
    turn = turn - refs[:, None, TURN] - radio.turns * more
    angle = 2 * math.pi * (turn - torch.round(turn))
    return torch.complex(gain * torch.cos(angle), gain * torch.sin(angle)), refs[:, None, REST] + radio.cells * more


def device_signal(
    network: Network, station: Station, motion, rcs_m2, aim_m, device: str = "cuda", sample: str = ""
) -> tuple[np.ndarray, np.ndarray]:
    """Return signal (N,) complex128 and range cell (N,) int64 of `station`, computed on a torch device.

    motion, rcs_m2, aim_m, sample: as for `echo_signal`. Memory: some (N, L) arrays and LARGEST_ARRAY numbers.
    Raises: InputError as `echo_signal` does, and where torch or the device is missing. Source: Eqs. 7 and 22 to 25.
    """
    try:
        import torch

        place = torch.empty(0, device=device).device
    except (ImportError, RuntimeError, AssertionError) as error:
        raise InputError(f"device is {device!r}, expected one that torch can use here ({error})") from error
    where = f"{sample}: " if sample else ""
    scene, radio = check(network, station, motion, rcs_m2, aim_m, sample), radar(network, station)
    first = scene.part[0] if len(scene.part) else 0
    start = np.ascontiguousarray(scene.translation[:, first])
    table = reference(start, radio)
    aims = aim_cosines(scene.aim, radio.station, radio.sine, radio.cosine)
    translation = torch.tensor(scene.translation - start[:, None], device=place)
    if scene.rotation.shape[0]:
        part = torch.tensor(scene.part, device=place)
        points = torch.tensor(scene.points, device=place)
        rotation = torch.tensor(scene.rotation, device=place)
        e = (rotation[:, part] @ points[:, :, None])[..., 0] + translation[:, part]
    else:
        e = translation
    refs = torch.tensor(table, device=place)
    z, u = _terms(torch, radio, refs, e, torch.tensor(scene.root_rcs, device=place), aims)
    if not bool(torch.isfinite(u).all() and torch.isfinite(torch.view_as_real(z)).all()):
        n, point = (int(i) for i in torch.nonzero(~torch.isfinite(z.real * u))[0])
        raise InputError(
            f"{where}position of point {point} at symbol {n} is {station.position_m}, the place of station "
            f"{station.name} (r = 0), expected r > 0"
        )
    cells, many = radio.subcarriers, max(1, LARGEST_ARRAY // u.numel())
    best = torch.full((len(table),), -1.0, dtype=torch.float64, device=place)
    value = torch.zeros(len(table), dtype=torch.complex128, device=place)
    which = torch.zeros(len(table), dtype=torch.int64, device=place)
    for low in range(0, cells, many):
        j = torch.arange(low, min(low + many, cells), dtype=torch.float64, device=place)
        weight = _dirichlet(torch, (j[:, None, None] - u) / cells, cells) / cells
        sums = torch.complex((weight * z.real).sum(dim=2), (weight * z.imag).sum(dim=2))
        largest, row = torch.abs(sums).max(dim=0)
        better = largest > best
        best = torch.where(better, largest, best)
        which = torch.where(better, row + low, which)
        value = torch.where(better, torch.gather(sums, 0, row[None])[0], value)
    cell = which.cpu().numpy() + table[:, CELL].astype(np.int64)
    # The cell's own phase is reduced in whole numbers until the last step.
    turn = (cells - 1) * (cell % (2 * cells)) % (2 * cells) / (2 * cells)
    return value.cpu().numpy() * np.exp(2j * np.pi * turn), cell % cells
