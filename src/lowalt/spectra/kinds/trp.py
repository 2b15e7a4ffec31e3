"""TRP: the short-time Fourier spectrum whose short window prefers resolution in time."""

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

TITLE = "time preferred (TRP)"
SOURCE = "paper, Eq. 29"
DEFAULTS = Settings(8, 1, 1024)
