"""lowalt: from meshes and motion to echoes, spectra, images, shards and a recogniser for the low
sky.

One folder a stage, in pipeline order: targets, motion, echo, noise, spectra, tiles, shards,
recognition, report.
"""

import importlib

__version__ = "1.0.0"


_HOMES = {
    "Dataset": "shards.dataset",
    "Endless": "shards.dataset",
    "RawEcho": "shards.receive",
    "confusion": "recognition.train_evaluate",
    "draft_target": "extensions.drafting.scaled",
    "evaluate": "recognition.train_evaluate",
    "inspect_recording": "extensions.recordings.file_inspection",
    "receive": "shards.receive",
    "train": "recognition.train_evaluate",
}
__all__ = sorted(_HOMES)


def __getattr__(name: str):
    """Import a name of `__all__` when it is first asked for."""
    # A stage's command line must not wait for the import of all other stages.
    if name in _HOMES:
        return getattr(importlib.import_module(f"lowalt.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """The names that programs use, for completion."""
    return sorted([*globals(), *__all__])
