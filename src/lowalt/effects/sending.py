"""What a station sends in one look, and how its receiver removes the data again.

Without transmitter effects the data are QPSK, the amplifier is linear, and all subcarriers are pilots.
"""

from collections.abc import Callable
from functools import cached_property

import numpy as np

from lowalt.common.network import Network
from lowalt.effects import transforms, waveform
from lowalt.effects.catalogue import NamedEffect, providing
from lowalt.effects.interface import ChangesWaveform, DrawsData, PicksSubcarriers
from lowalt.effects.tone_loops import divided


class Sending:
    """The data of a look of one station, what is on the air, and range cells by the pilots.

    effects: the scene's transmitter effects; draws: as in `chain.Chain`.
    """

    def __init__(self, effects: list[NamedEffect], network: Network, draws: Callable[[str], np.random.Generator]):
        self.network, self.draws = network, draws
        self.source = next(iter(providing(effects, DrawsData)), None)
        self.amplifiers = providing(effects, ChangesWaveform)
        self.pilots = next(iter(providing(effects, PicksSubcarriers)), None)

    @property
    def distorts(self) -> bool:
        """Whether the waveform on the air is not that of the data."""
        return bool(self.amplifiers)

    @cached_property
    def known(self) -> np.ndarray:
        """The data (N, M) that all symbols carry, as the receiver knows them."""
        return self._drawn("waveform") if self.source is not None else waveform.of_signs(self.signs)

    @cached_property
    def signs(self) -> np.ndarray:
        """The signs (2, N, M) int8 of QPSK data (`waveform.sent_signs`), where no effect chooses other data."""
        return waveform.sent_signs(self.draws("waveform"), self.network.symbols, self.network.subcarriers)

    @cached_property
    def aired(self) -> np.ndarray:
        """The subcarriers (N, M) on the air."""
        return self._amplified(self.known)

    @cached_property
    def aired_before(self) -> np.ndarray:
        """The subcarriers (N, M) on the air in the symbol before each symbol of the look."""
        return self.aired_as("previous waveform")

    def aired_as(self, name: str) -> np.ndarray:
        """Return subcarriers (N, M) on the air whose data come of the stream `name`, another symbol's or station's."""
        return self._amplified(self._drawn(name))

    def cells(self, spectrum: np.ndarray) -> np.ndarray:
        """Return the range cells of responses (N, M): all M, or those of the pilots' comb."""
        if self.pilots is None:
            return transforms.inverse(spectrum)
        return self.pilots.module.range_cells(self.pilots.settings, spectrum)

    def received(self, samples: np.ndarray, rows: slice | np.ndarray) -> np.ndarray:
        """Return the responses (N, M) of the time samples of the symbols `rows`, the known data divided out."""
        found, signs = self.carrying(transforms.forward(samples), rows)
        return found if signs is None else waveform.without(found, self.known[rows])

    def with_samples(self, responses: np.ndarray, samples: np.ndarray, rows: slice | np.ndarray) -> np.ndarray:
        """Return responses (N, M) plus those of time samples (N, M) of the symbols `rows`; both are overwritten."""
        found, signs = self.carrying(transforms.forward(samples, out=samples), rows)
        if signs is None:
            return responses + found
        divided(found, np.ascontiguousarray(self.known[rows]), False, responses)
        return responses

    def carrying(self, tones: np.ndarray, rows: slice | np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Return the tones (N, M) of samples of the symbols `rows`, and the signs (2, N, M) of the data in them.

        Data of any but unit modulus are divided out: responses, and None.
        """
        if self.source is None:
            return tones, self.signs[:, rows]
        return np.fft.fftshift(tones, axes=-1) / self.known[rows], None

    def still(self, spectrum: np.ndarray, prefix: NamedEffect | None, offset_cells: float = 0.0) -> np.ndarray:
        """Return time samples (N, M) of responses (N, M). With a `prefix`, later cells begin with the previous symbol.

        offset_cells: distance of the echoes beyond their cells' centres; the symbols arrive later by as much.
        """
        if prefix is None:
            return waveform.transmit(spectrum, self.aired)
        later = np.exp(-2j * np.pi * offset_cells * np.arange(spectrum.shape[1]) / spectrum.shape[1])
        symbols = transforms.turned(self.aired, later), transforms.turned(self.aired_before, later)
        # Frequencies count from the lowest subcarrier in range cells, from the oscillator's, M // 2 higher, in samples:
        # the phase turns by pi from cell to cell.
        cells = transforms.turned(spectrum, later.conj())
        return prefix.module.convolved(prefix.settings, self.network, cells, symbols)

    def _drawn(self, name: str) -> np.ndarray:
        """The data (N, M) of one look, drawn: QPSK unless an effect chooses them."""
        shape = self.network.symbols, self.network.subcarriers
        if self.source is None:
            return waveform.sent(self.draws(name), *shape)
        return self.source.module.data(self.source.settings, *shape, self.draws(name))

    def _amplified(self, data: np.ndarray) -> np.ndarray:
        """The subcarriers (N, M) on the air for these data, after all amplifier effects."""
        for effect in self.amplifiers:
            data = effect.module.aired(effect.settings, data)
        return data
