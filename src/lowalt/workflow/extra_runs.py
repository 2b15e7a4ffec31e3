"""The files of other, finished runs that a run trains on too (`recognition.extra`); targets of those runs make them."""

from pathlib import Path

from lowalt.common.errors import InputError
from lowalt.recognition.schemes import Scheme

TARGETS = {"views": "training_samples", "slow_time": "slow_times", "tracks": "tracks"}
"""The target that makes the files of each folder of a run."""


def files(name: str, folder: str) -> list[str]:
    """Return the files of a folder of another run, for its shards of the fold train in their order.

    name: the run; folder: as "views/24", "slow_time" or "tracks". Raises: InputError naming the first missing file and
    the target that makes it.
    """
    shards = sorted(Path(f"results/{name}/shards").glob("*-train-*.tar"))
    paths = [f"results/{name}/{folder}/{shard.stem}.npz" for shard in shards]
    missing = [path for path in paths if not Path(path).is_file()]
    if missing or not paths:
        kind, _, size = folder.partition("/")
        raise InputError(
            f"recognition.extra: no {(missing or [f'results/{name}/shards'])[0]}; expected what the target "
            f"`{TARGETS[kind]}` makes in the run {name!r}{f' (at {size} pixels)' if size else ''}"
        )
    return paths


def of_scheme(names: list[str], scheme: Scheme, size: int) -> dict[str, list[str]]:
    """Return the files that a scheme's training reads of other runs: images of this size or signals, and heights.

    Raises: InputError as `files`.
    """
    folders = {"extra": f"views/{size}" if scheme.sees == "images" else "slow_time"}
    if scheme.cues:
        folders["extra_tracks"] = "tracks"
    return {key: [path for name in names for path in files(name, folder)] for key, folder in folders.items() if names}
