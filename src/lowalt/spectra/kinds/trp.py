"""TRP: the short-time Fourier spectrum whose short window prefers resolution in time."""

from lowalt.spectra import fourier

TITLE = "time preferred (TRP)"
SOURCE = "paper, Eq. 29"
SIGNED = False
ZERO_FIRST = True
Settings = fourier.Fourier
DEFAULTS = Settings(8, 1, 1024)
rows, speeds, definition = fourier.rows, fourier.speeds, fourier.definition
tables, fill, on_device = fourier.tables, fourier.fill, fourier.on_device
