"""Time-frequency spectra of symbol-domain signals: VRP, TRP, VT (paper, sections IV-B to IV-E)."""

from lowalt.spectra.catalogue import NAMES, Spectra, spectrum, zero_index
from lowalt.spectra.definitions import trp, vrp, vt
from lowalt.spectra.fourier import magnitudes
from lowalt.spectra.settings import Fourier, Transfer, windows

__all__ = [
    "NAMES",
    "Fourier",
    "Spectra",
    "Transfer",
    "magnitudes",
    "spectrum",
    "trp",
    "vrp",
    "vt",
    "windows",
    "zero_index",
]
