"""Time-frequency spectra of symbol-domain signals: VRP, TRP and VT (paper, section IV-B to IV-E)."""

from lowalt.spectra.definitions import magnitudes, trp, vrp, vt
from lowalt.spectra.settings import Fourier, Spectra, Transfer, windows

__all__ = ["Fourier", "Spectra", "Transfer", "magnitudes", "trp", "vrp", "vt", "windows"]
