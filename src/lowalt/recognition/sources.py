"""The options of a command line that name samples, and the check of these samples."""

from argparse import ArgumentParser
from typing import Any

from lowalt.common.errors import InputError
from lowalt.recognition.schemes import Scheme


def name_sources(line: ArgumentParser) -> None:
    """Add the arguments that name samples: cached views, shards, or a data set that makes them."""
    line.add_argument("--views", nargs="+", help="caches of views (.npz)")
    line.add_argument("--signals", nargs="+", help="for schemes on signals or features: their caches (.npz)")
    line.add_argument("--index", help="instead of --views: index of the shards, read sample by sample")
    line.add_argument("--dataset", help="instead of both: config.yaml of a run with clouds, whose samples are made")
    line.add_argument("--tracks", nargs="+", help="for schemes with the cue height: measured heights (.npz)")
    line.add_argument("--frozen", nargs="+", default=[], help="SHA256SUMS of clouds and motion tables, checked first")


def of_size(found: Any, scheme: Scheme, size: int) -> Any:
    """Return the samples; refuse images or signals of another size than the settings'."""
    if found.size != size and scheme.sees != "features":
        content = f"images of {found.size} pixels" if scheme.sees == "images" else f"signals of {found.size} symbols"
        raise InputError(f"--{'views' if scheme.sees == 'images' else 'signals'}: {content}, settings say {size}")
    return found
