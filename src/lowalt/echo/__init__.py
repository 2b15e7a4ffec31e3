"""The echo: the signal that a station receives from moving points, exact or within a tolerance."""

from lowalt.echo.api import EchoResult, echo_signal, echo_signals
from lowalt.echo.echo_input import Rigid

__all__ = ["EchoResult", "Rigid", "echo_signal", "echo_signals"]
