"""Command-line options of a stage that depend on the job: a list of words, empty if the job lacks
the input.

Each function takes the wildcards and the inputs of a job and can stand in a rule's `params:`.
Snakemake's format `:q` quotes every word of a list for the shell.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lowalt.scene.effects import dotted
from lowalt.scene.lateness import late_effects
from lowalt.scene.set_noise import filters
from lowalt.spectra.catalogue import of_cells


def _option(name: str, files: str | list[str] | None) -> list[str]:
    """An option with its files; empty without files."""
    return [f"--{name}", *([files] if isinstance(files, str) else files)] if files else []


def of_inputs(*names: str) -> Callable[[Any, Any], list[str]]:
    """Return a function that gives the options for those of these inputs that a job has."""

    def words(wildcards: Any, input: Any) -> list[str]:
        """The options of one job."""
        return [word for name in names for word in _option(name, input.get(name))]

    return words


occluders = of_inputs("occluders")
powers = of_inputs("powers")
scene = of_inputs("motion", "clouds", "occluders")
"""Further inputs of the tiles stage, needed for late symbols or range cells."""
content = of_inputs("signals", "tiles", "echoes", "powers", "clouds", "occluders")
"""The files from which a shard of some kind is packed."""
reduced_chunk = of_inputs("reduced", "motion")
"""The reduced images of a chunk and its motion table, if the tiles stage makes them at the required
size.
"""
samples = of_inputs("dataset", "views", "index")
"""The configuration to make samples from, the shrunk images, or the index of the shards: a job has
one of them.
"""


def reduced(wildcards: Any, output: Any) -> list[str]:
    """The reduced images of a chunk that the tiles stage writes, by their size, which is the name
    of their folder.
    """
    return _option("reduced", [f"{Path(path).parent.name}={path}" for path in output.reduced])


def noise_modules(config: dict) -> list[str]:
    """The modules that the noise stage loads in a scene whose filters the noise passes."""
    passed = filters(config["effects"])
    return ["lowalt.scene.set_noise", *map(dotted, passed)] if passed else []


def shard_modules(config: dict) -> list[str]:
    """The modules of effects that the shards stage loads: all where it makes cubes, the town's for
    what records say.
    """
    town = [dotted("town")] if "town" in config["effects"] else []
    return [*map(dotted, config["effects"])] if config["shards"]["kind"] == "cube" else town


def tile_modules(config: dict) -> list[str]:
    """The modules that the tiles stage loads where spectra know the instants of late symbols or
    show range cells.
    """
    named = late_effects(config)
    late = ["lowalt.scene.lateness", "lowalt.motion", *map(dotted, named)] if named else []
    return (
        [*late, "lowalt.tiles.cubes", *map(dotted, config["effects"])]
        if of_cells(config["spectra"])
        else late
    )
