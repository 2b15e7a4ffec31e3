"""lowalt: from meshes and motion to echoes, spectra, images, shards and a recogniser for the low sky.

One folder a stage, in pipeline order: targets, motion, echo, noise, spectra, tiles, shards, recognition, report.
"""

__version__ = "0.2.0"


__all__ = ["Dataset", "Endless", "evaluate", "train"]


def __getattr__(name: str):
    """Import `Dataset`, `Endless`, `train` or `evaluate` when it is first asked for."""
    # A stage's command line must not wait for the import of all other stages.
    if name in ("Dataset", "Endless"):
        from lowalt.shards import dataset

        return getattr(dataset, name)
    if name in ("train", "evaluate"):
        from lowalt.recognition import train_evaluate

        return getattr(train_evaluate, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """The names that programs use, for completion."""
    return sorted([*globals(), *__all__])
