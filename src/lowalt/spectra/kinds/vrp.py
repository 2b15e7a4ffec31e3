"""VRP: the short-time Fourier spectrum whose long window prefers resolution in velocity."""

from lowalt.spectra import fourier

TITLE = "velocity preferred (VRP)"
SOURCE = "paper, Eq. 28"
SIGNED = False
ZERO_FIRST = True
Settings = fourier.Fourier
DEFAULTS = Settings(256, 1, 256)
rows, speeds, definition = fourier.rows, fourier.speeds, fourier.definition
tables, fill, on_device = fourier.tables, fourier.fill, fourier.on_device
