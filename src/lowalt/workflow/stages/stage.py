"""What all stages share: the run, the chunk of a job, texts of settings, and words of options.

A stage's class offers what its rules take, while the rules themselves show the paths:

- values of wildcards, for `expand`; a function is called with the wildcards of each job;
- settings: a JSON text with only the values that the stage reads. Snakemake compares these texts,
  so a changed value re-runs only the stages that read it;
- options: words of a command that only some jobs have. Snakemake's format `:q` quotes each of them.

No file is read here.
"""

from collections.abc import Callable
from typing import Any

from lowalt.config.layers import canonical
from lowalt.files.atomic import slug
from lowalt.scene.effects import effect_files, needed_subtypes, needs_surfaces
from lowalt.shards.plan import Chunk
from lowalt.workflow.run import Run


def text(**block: Any) -> str:
    """Return the JSON text of a block of settings."""
    return canonical(block)


def option(name: str, files: str | list[str] | None) -> list[str]:
    """Return an option with its files, as words; none without files."""
    if not files:
        return []
    if isinstance(files, str):
        files = [files]
    return [f"--{name}", *files]


def given(*names: str) -> Callable[[Any, Any], list[str]]:
    """Return a function of wildcards and inputs: the options for the inputs that a job has."""

    def words(wildcards: Any, input: Any) -> list[str]:
        """Return the options of one job."""
        result = []
        for name in names:
            result += option(name, input.get(name))
        return result

    return words


class RunStage:
    """What the rules of one stage take, derived from a run."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._config = run.config

    def _blocks(self, *names: str) -> dict:
        """Return blocks of the configuration by name."""
        return {name: self._config[name] for name in names}

    @property
    def _published(self) -> dict[str, dict]:
        """Rows of the table of targets by subtype."""
        return {name: record["published"] for name, record in self._run.records.items()}

    def _chunk(self, wildcards: Any) -> Chunk:
        """Return the chunk of a job."""
        return self._run.plan.chunk(f"{wildcards.group}-{wildcards.part}")

    def _snrs(self, wildcards: Any) -> list[float]:
        """Return the SNRs (dB) of a job's chunk, as the configuration writes them."""
        written = {}
        for step in (self._config["noise"], *self._config.get("added", [])):
            for snr in step.get("snr_db", []):
                written[float(snr)] = snr
        return [written[snr] for snr in self._chunk(wildcards).snrs]

    def source(self, wildcards: Any) -> str:
        """Return the chunk whose motion models and echoes a job uses.

        It is the job's own, or the one to which its chunk adds SNRs.
        """
        return self._chunk(wildcards).source

    def subtypes(self, wildcards: Any) -> list[str]:
        """Return the file names of a chunk's subtypes, in the table's order."""
        return [slug(name) for name in self._chunk(wildcards).members]

    def scene_subtypes(self, wildcards: Any) -> list[str]:
        """Return the file names of a chunk's subtypes and of those that the effects need."""
        beside = [slug(name) for name in needed_subtypes(self._config["effects"])]
        return list(dict.fromkeys([*self.subtypes(wildcards), *beside]))

    def opaque_subtypes(self, wildcards: Any) -> list[str]:
        """Return the file names of a chunk's subtypes where the effects need their surfaces."""
        if not needs_surfaces(self._config["effects"]):
            return []
        return self.subtypes(wildcards)

    @property
    def effect_files(self) -> list[str]:
        """The files that the scene's effects read."""
        return effect_files(self._config["effects"])

    @property
    def power_stations(self) -> list[str]:
        """Stations at which the powers of the targets' own echoes are stored.

        SNRs refer to these powers in a scene with effects; without effects there is no station.
        """
        if not self._config["effects"]:
            return []
        return self._run.stations
