"""The echo: the signal that a base station receives from moving scattering points, exactly or to a tolerance."""

from lowalt.echo.api import EchoResult, Path, echo_matrix, echo_signal, echo_signals, method_text
from lowalt.echo.profile import Profile, range_profile
from lowalt.echo.scene import Rigid

__all__ = [
    "EchoResult", "Path", "Profile", "Rigid", "echo_matrix", "echo_signal", "echo_signals", "method_text",
    "range_profile",
]  # fmt: skip
