"""VRP: the short-time Fourier spectrum whose long window prefers resolution in velocity."""

# Both short-time Fourier spectra share all other functions.
from lowalt.spectra.fourier import (  # noqa: F401
    SIGNED,
    ZERO_FIRST,
    definition,
    fill,
    fill_known,
    rows,
    speeds,
    tables,
)
from lowalt.spectra.settings import Fourier as Settings

TITLE = "velocity preferred (VRP)"
SOURCE = "paper, Eq. 28"
DEFAULTS = Settings(256, 1, 256)
