"""What only the user may choose of a scene's effects: own code, and files that effects read."""

from collections.abc import Mapping
from pathlib import Path

from lowalt.config.named_code import own_effects
from lowalt.files.errors import InputError
from lowalt.scene.effects import complete


def refuse_effects(effects: Mapping[str, dict | None], where: str | Path) -> None:
    """Refuse effects of the user's own, and files that effects read.

    They stand in what may be a stranger's file or folder.

    No code that the block names is run, and no file is read. Raises: InputError naming the effect.
    """
    advice = "which a file may not choose; expected an overlay of your own that names it"
    for name in own_effects(effects):
        raise InputError(f"{where}: its effect {name!r} is code, {advice}")
    for effect in complete(effects):
        for path in effect.named_files.values():
            raise InputError(
                f"{where}: its effect {effect.name!r} reads the file {path!r}, {advice}"
            )
