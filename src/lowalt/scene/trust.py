"""What only the user may choose of a scene's effects: code of their own, and files that they read."""

from collections.abc import Mapping
from pathlib import Path

from lowalt.config.named_code import own_effects
from lowalt.files.errors import InputError


def buildings_of(effects: Mapping[str, dict | None]) -> str | None:
    """Return the file of buildings that an `effects` block names, None for none."""
    return (effects.get("town") or {}).get("buildings")


def refuse_effects(effects: Mapping[str, dict | None], where: str | Path) -> None:
    """Refuse effects of the user's own, and files that effects read, in what may be a stranger's
    file or folder.

    Raises: InputError naming the effect.
    """
    advice = "which a file may not choose; expected an overlay of your own that names it"
    if buildings := buildings_of(effects):
        raise InputError(f"{where}: its effect 'town' reads the file {buildings!r}, {advice}")
    for name in own_effects(effects):
        raise InputError(f"{where}: its effect {name!r} is code, {advice}")
