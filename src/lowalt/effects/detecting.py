"""What a scene's detection effects make of range cells: filters, and the choice of a cell in each symbol."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

from lowalt.effects import need
from lowalt.effects.catalogue import NamedEffect, providing
from lowalt.effects.interface import ChoosesCells, FiltersCells
from lowalt.effects.waveform import Frame


@runtime_checkable
class FiltersSymbols(Protocol):
    """Optional, detection: a filter over symbols, alike in all cells, that does to responses what it does to cells."""

    ALONG_SYMBOLS: bool


@runtime_checkable
class ChoosesAfresh(Protocol):
    """Optional, detection: a choice of range cells that does not depend on the cells chosen before it."""

    CHOOSES_AFRESH: bool


def filtered(
    effects: list[NamedEffect], cells: np.ndarray, frame: Frame, draws: Callable[[str], np.random.Generator]
) -> np.ndarray:
    """Return range cells, or responses, (N, M) behind the filters among the effects; draws: as in `chain.Chain`."""
    for effect in providing(effects, FiltersCells):
        cells = effect.module.process(effect.settings, cells, frame, draws(effect.name))
    return cells


def chosen(
    effects: list[NamedEffect], cells: np.ndarray, draws: Callable[[str], np.random.Generator], leads: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return the chosen range cells (N,) of cells (N, M), and by how much each symbol's strongest leads (N,).

    The strongest is chosen unless effects say otherwise. leads: whether the second result is needed; NaN without.
    """
    choices, lead = providing(effects, ChoosesCells), np.full(len(cells), np.nan)
    best = np.zeros(len(cells), np.int64)
    if leads or not providing(choices[:1], ChoosesAfresh):
        size = abs(cells)
        best, lead = size.argmax(axis=1), need.gap(size) if leads else lead
    for effect in choices:
        best = effect.module.choose(effect.settings, best, cells, draws(effect.name))
    return best, lead
