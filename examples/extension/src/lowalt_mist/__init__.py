"""Mist between a station and its target, the spectrum `power`, and the command `lowalt mist`."""

from lowalt.config.core_commands import Command
from lowalt.config.extensions import AddedEffect, Extension

MIST = Extension(
    commands={"mist": Command("lowalt_mist.command", "how much of a wave mist leaves", "lowalt mist 500")},
    effects={"mist": AddedEffect("lowalt_mist.effect", "channel")},
    spectra={"power": "lowalt_mist.power"},
)
