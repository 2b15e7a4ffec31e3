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
    "evaluate": "recognition.train_evaluate",
    "receive": "shards.receive",
    "train": "recognition.train_evaluate",
}
__all__ = sorted(_HOMES)


def __getattr__(name: str):
    """Import a function of the core or of an extension when it is first asked for."""
    # A stage's command line must not wait for the import of all other stages.
    if name in _HOMES:
        return getattr(importlib.import_module(f"lowalt.{_HOMES[name]}"), name)
    # Python asks for names with underscores while it imports; no extension is looked for then.
    added = {} if name.startswith("_") else _of_extensions()
    if name in added:
        from lowalt.config.extensions import function_offered

        return function_offered("functions", name, added[name], name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _of_extensions() -> dict[str, str]:
    """The modules of the functions that extensions offer, by name."""
    from lowalt.config.extensions import offered

    return offered("functions")


def __dir__() -> list[str]:
    """The names that programs use, for completion."""
    return sorted([*globals(), *__all__, *_of_extensions()])
