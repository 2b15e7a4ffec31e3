"""lowalt: from meshes and motion to echoes, spectra, images, shards and a recogniser for the low sky.

One folder a stage, in pipeline order: targets, motion, echo, noise, spectra, tiles, shards, recognition, report.
"""

__version__ = "0.2.0"


def __getattr__(name: str):
    """Import `Dataset` or `Endless` when it is first asked for."""
    # A stage's command line must not wait for the import of all other stages.
    if name in ("Dataset", "Endless"):
        from lowalt.shards import dataset

        return getattr(dataset, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
