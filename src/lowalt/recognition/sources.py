"""The options of a command line that name samples, and the check of these samples."""

from argparse import ArgumentParser

from lowalt.files.errors import InputError
from lowalt.recognition.samples import Samples


def name_sources(line: ArgumentParser) -> None:
    """Add the arguments that name samples: cached views, shards, or a data set that makes them."""
    line.add_argument("--views", nargs="+", help="caches of views (.npz)")
    line.add_argument("--index", help="instead of --views: index of the shards, read sample by sample")
    line.add_argument("--dataset", help="instead of both: config.yaml of a run with clouds, whose samples are made")
    line.add_argument("--frozen", nargs="+", default=[], help="SHA256SUMS of clouds and motion tables, checked first")


def of_size(found: Samples, size: int) -> Samples:
    """Return the samples; refuse images of another size than the settings'."""
    if found.size != size:
        raise InputError(f"--views: images of {found.size} pixels, settings say {size}")
    return found
