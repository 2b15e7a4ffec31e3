"""The options of a command line that name samples, and the samples that they name."""

from argparse import ArgumentParser, Namespace
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


def open_samples(given: Namespace, pairs: set, scheme: Scheme, size: int, placed: bool) -> Any:
    """Return the samples of some (group, fold) pairs from the source the command line names, heights included.

    Raises: InputError where not one source is named, or tracks are and the scheme has no cue, or the other way round.
    """
    if (given.tracks is None) == bool(scheme.cues):
        raise InputError(
            f"--tracks: scheme {scheme.name!r} has {f'the cue {scheme.cues!r}' if scheme.cues else 'no cue'}"
        )
    found = _seen(given, pairs, scheme, size, placed)
    if not scheme.cues:
        return found
    from lowalt.recognition.tracked import Tracked

    return Tracked(found, given.tracks, scheme.stations)


def _seen(given: Namespace, pairs: set, scheme: Scheme, size: int, placed: bool) -> Any:
    """Return the samples without heights."""
    from lowalt.recognition.samples import ViewSamples
    from lowalt.recognition.views import ShardSamples

    if sum(source is not None for source in (given.views, given.signals, given.index, given.dataset)) != 1:
        raise InputError("expected one of --views, --signals, --index and --dataset")
    if (given.signals is None) != (scheme.sees == "images"):
        raise InputError(f"--signals: scheme {scheme.name!r} sees {scheme.sees}")
    if given.signals is not None:
        from lowalt.recognition.slow_time import SlowTimeSamples

        return of_size(SlowTimeSamples(given.signals, scheme.sees, scheme.columns, pairs), scheme, size)
    if given.dataset is not None:
        from lowalt.recognition.made import DatasetSamples, opened

        return DatasetSamples(opened(given.dataset), scheme.columns, pairs, size, placed)
    if given.views is None:
        return ShardSamples(given.index, scheme.columns, pairs, size, placed)
    return of_size(ViewSamples(given.views, scheme.columns, pairs), scheme, size)
