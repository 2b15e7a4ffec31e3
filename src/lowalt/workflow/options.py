"""Options of a stage's command line that stand there only where the job has the input they name.

Each function takes the wildcards and the inputs of a job and can stand in a rule's `params:`.
"""

from typing import Any


def occluders(wildcards: Any, input: Any) -> str:
    """The surfaces of a group, where points are hidden behind them."""
    return f"--occluders {input.occluders}" if input.occluders else ""


def powers(wildcards: Any, input: Any) -> str:
    """The powers to which set SNRs refer, in a scene with effects."""
    return f"--powers {input.powers}" if input.powers else ""


def tiles(wildcards: Any, input: Any) -> str:
    """The tiles of a chunk, where shards hold images."""
    return f"--tiles {input.tiles}" if input.get("tiles") else ""


def samples(wildcards: Any, input: Any) -> str:
    """The shrunk images, or the index of the shards."""
    return f"--views {input.views}" if input.get("views") else f"--index {input.index}"
