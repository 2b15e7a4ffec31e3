"""A run of the default configuration with an overlay, and what the rules of its stages take."""

from dataclasses import dataclass
from pathlib import Path

from lowalt.config.layers import merge
from lowalt.files.yaml_files import load_yaml
from lowalt.workflow.run import Run
from lowalt.workflow.stages.accuracy_cost import AccuracyCost
from lowalt.workflow.stages.cost import Cost
from lowalt.workflow.stages.echo import Echo
from lowalt.workflow.stages.motion import Motion
from lowalt.workflow.stages.noise import Noise
from lowalt.workflow.stages.recognition import Recognition
from lowalt.workflow.stages.report import Report
from lowalt.workflow.stages.shards import Shards
from lowalt.workflow.stages.targets import Targets
from lowalt.workflow.stages.tiles import Tiles

ROOT = Path(__file__).parents[2]
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"


class Inputs(dict):
    """A job's inputs by name, read as items or attributes, as Snakemake gives them."""

    __getattr__ = dict.__getitem__


@dataclass
class Stages:
    """The stages of a run, by the names that rules give them."""

    run: Run

    def __post_init__(self) -> None:
        self.targets = Targets(self.run)
        self.motion = Motion(self.run)
        self.echo = Echo(self.run)
        self.noise = Noise(self.run)
        self.tiles = Tiles(self.run)
        self.shards = Shards(self.run)
        self.recognition = Recognition(self.run)
        self.cost = Cost(self.run)
        self.accuracy_cost = AccuracyCost(self.run)
        self.page = Report(self.run)


def run_of(overlay: dict | None = None, inputs: str | None = None) -> Run:
    """The run of the default configuration with an overlay on it."""
    return Run.of(merge(load_yaml("config/default.yaml"), overlay or {}), SCHEMA, inputs)


def stages_of(overlay: dict | None = None) -> Stages:
    """The stages of the run of an overlay."""
    return Stages(run_of(overlay))
