"""The echo: what a base station hears of a moving cloud of scattering points, exactly or to a tolerance."""

from lowalt.echo.api import EchoResult, Path, echo_signal, echo_signals, explain, range_cells, subcarrier_matrix
from lowalt.echo.scene import Rigid

__all__ = ["EchoResult", "Path", "Rigid", "echo_signal", "echo_signals", "explain", "range_cells", "subcarrier_matrix"]
