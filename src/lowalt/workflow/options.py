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


def extra(wildcards: Any, input: Any) -> list[str]:
    """The shrunk images or the signals of other runs that are trained on too, and their measured heights."""
    tracks = _option("extra-tracks", input.get("extra_tracks"))
    return [*_option("extra", input.extra), *tracks] if input.get("extra") else []


def noisy_chunk(wildcards: Any, input: Any) -> list[str]:
    """The noisy signals of a chunk and its motion table, where shards hold images alone."""
    return [*_option("noisy", input.noisy), *_option("motion", input.motion)] if input.get("noisy") else []


def timed_model(wildcards: Any, input: Any) -> list[str]:
    """The trained model to time, where its time depends on its training."""
    return _option("model", input.model)


def fidelity(wildcards: Any, input: Any) -> list[str]:
    """The table of models trained on echoes at a tolerance, where there is one."""
    return _option("fidelity", input.fidelity)


def stream(wildcards: Any, input: Any) -> list[str]:
    """The configuration whose fresh motion models are trained on."""
    return _option("stream", input.get("stream"))


def start(wildcards: Any, input: Any) -> list[str]:
    """The trained model whose weights a training starts from."""
    return _option("start", input.get("start"))


def samples(wildcards: Any, input: Any) -> list[str]:
    """Options that name the signals, the shrunk images, the index of the shards, or the configuration to make samples
    from; and the measured heights, for a scheme with the cue."""
    kind = next(name for name in ("dataset", "signals", "views", "index") if input.get(name))
    tracks = _option("tracks", input.get("tracks")) if kind in ("views", "index") else []
    return [*_option(kind, input.get(kind)), *tracks]
