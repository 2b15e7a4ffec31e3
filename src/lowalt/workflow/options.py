"""Options of a stage's command line that depend on the job: each is an empty text where the job lacks its input.

Each function takes the wildcards and the inputs of a job and can stand in a rule's `params:`.
"""

from pathlib import Path
from typing import Any

from lowalt.effects.catalogue import dotted
from lowalt.effects.lateness import timed
from lowalt.spectra.catalogue import profiled


def occluders(wildcards: Any, input: Any) -> str:
    """The surfaces of a group, where points are hidden behind them."""
    return f"--occluders {input.occluders}" if input.occluders else ""


def powers(wildcards: Any, input: Any) -> str:
    """The powers to which set SNRs refer, in a scene with effects."""
    return f"--powers {input.powers}" if input.powers else ""


def motion(wildcards: Any, input: Any) -> str:
    """The motion table of a chunk, where the job has it."""
    return f"--motion {input.motion}" if input.motion else ""


def noise_modules(config: dict) -> list[str]:
    """The modules that the noise stage loads in a scene with a canceller."""
    return ["lowalt.effects.set_noise", dotted("canceller")] if "canceller" in config["effects"] else []


def clouds(wildcards: Any, input: Any) -> str:
    """The clouds of a chunk, where the job has them."""
    return f"--clouds {input.clouds}" if input.clouds else ""


def tile_modules(config: dict) -> list[str]:
    """The modules that the tiles stage loads where spectra know the instants of late symbols or show range profiles."""
    late = ["lowalt.effects.lateness", "lowalt.motion", dotted("slow_time")] if timed(config) else []
    return [*late, "lowalt.tiles.profiles"] if profiled(config["spectra"]) else late


def content(wildcards: Any, input: Any) -> str:
    """Options that name the files that a shard is packed from, by its kind."""
    found = {name: input.get(name) for name in ("signals", "tiles", "echoes", "powers")}
    return " ".join(f"--{name} {paths}" for name, paths in found.items() if paths)


def reduced(wildcards: Any, output: Any) -> str:
    """The reduced images of a chunk that the tiles stage writes, by their size, which is the name of their folder."""
    targets = [f"{Path(path).parent.name}={path}" for path in output.reduced]
    return f"--reduced {' '.join(targets)}" if targets else ""


def reduced_chunk(wildcards: Any, input: Any) -> str:
    """The reduced images of a chunk and its motion table, where the tiles stage makes them at the size asked for."""
    return f"--reduced {input.reduced} --motion {input.motion}" if input.get("reduced") else ""


def fidelity(wildcards: Any, input: Any) -> str:
    """The table of models trained on echoes at a tolerance, where there is one."""
    return f"--fidelity {input.fidelity}" if input.fidelity else ""


def samples(wildcards: Any, input: Any) -> str:
    """Options that name the shrunk images, the index of the shards, or the configuration to make samples from."""
    if input.get("dataset"):
        return f"--dataset {input.dataset}"
    return f"--views {input.views}" if input.get("views") else f"--index {input.index}"
