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


def cost(wildcards: Any, input: Any) -> str:
    """Tables and figure of what the echo's accuracy costs, where the report shows them."""
    return "--cost {} {} {}".format(*input.cost) if input.cost else ""


def effects(wildcards: Any, input: Any) -> str:
    """Table and figure of what effects cost and do, where the report shows them."""
    return "--effects {} {}".format(*input.effects) if input.effects else ""


def recognition(wildcards: Any, input: Any) -> str:
    """What recognition left beside its accuracy, for the report."""
    names = ("orderings", "alarms", "calibration", "reliability")
    options = [f"--{name} results/{wildcards.run}/{name}.csv" for name in names]
    options += [f"--distances {input.distances}"]
    options += [f"--transfer {input.transfer}"] if input.transfer else []
    options += [f"--accuracy-cost {input.accuracy}"] if input.accuracy else []
    return " ".join(options)
