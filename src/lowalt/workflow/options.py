"""Options of a stage's command line that depend on the job: a list of words, empty where the job lacks its input.

Each function takes the wildcards and the inputs of a job and can stand in a rule's `params:`. Snakemake's format `:q`
quotes every word of a list for the shell.
"""

from pathlib import Path
from typing import Any

from lowalt.scene.catalogue import dotted
from lowalt.scene.lateness import timed
from lowalt.spectra.catalogue import profiled


def _option(name: str, files: str | list[str] | None) -> list[str]:
    """An option with the files that it names, nothing where there are none."""
    return [f"--{name}", *([files] if isinstance(files, str) else files)] if files else []


def occluders(wildcards: Any, input: Any) -> list[str]:
    """The surfaces of a group, where points are hidden behind them."""
    return _option("occluders", input.occluders)


def powers(wildcards: Any, input: Any) -> list[str]:
    """The powers to which set SNRs refer, in a scene with effects."""
    return _option("powers", input.powers)


def motion(wildcards: Any, input: Any) -> list[str]:
    """The motion table of a chunk, where the job has it."""
    return _option("motion", input.motion)


def noise_modules(config: dict) -> list[str]:
    """The modules that the noise stage loads in a scene with a canceller."""
    return ["lowalt.scene.set_noise", dotted("canceller")] if "canceller" in config["effects"] else []


def clouds(wildcards: Any, input: Any) -> list[str]:
    """The clouds of a chunk, where the job has them."""
    return _option("clouds", input.clouds)


def tile_modules(config: dict) -> list[str]:
    """The modules that the tiles stage loads where spectra know the instants of late symbols or show range profiles."""
    late = ["lowalt.scene.lateness", "lowalt.motion", dotted("slow_time")] if timed(config) else []
    return [*late, "lowalt.tiles.profiles"] if profiled(config["spectra"]) else late


def content(wildcards: Any, input: Any) -> list[str]:
    """Options that name the files that a shard is packed from, by its kind."""
    return [word for name in ("signals", "tiles", "echoes", "powers") for word in _option(name, input.get(name))]


def reduced(wildcards: Any, output: Any) -> list[str]:
    """The reduced images of a chunk that the tiles stage writes, by their size, which is the name of their folder."""
    return _option("reduced", [f"{Path(path).parent.name}={path}" for path in output.reduced])


def reduced_chunk(wildcards: Any, input: Any) -> list[str]:
    """The reduced images of a chunk and its motion table, where the tiles stage makes them at the size asked for."""
    return [*_option("reduced", input.reduced), *_option("motion", input.motion)] if input.get("reduced") else []


def fidelity(wildcards: Any, input: Any) -> list[str]:
    """The table of models trained on echoes at a tolerance, where there is one."""
    return _option("fidelity", input.fidelity)


def samples(wildcards: Any, input: Any) -> list[str]:
    """Options that name the shrunk images, the index of the shards, or the configuration to make samples from."""
    kind = next(name for name in ("dataset", "views", "index") if input.get(name))
    return _option(kind, input.get(kind))
