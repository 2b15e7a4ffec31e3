"""A run of the default configuration with an overlay, and what the rules of its stages take."""

from dataclasses import dataclass
from pathlib import Path

from lowalt.config.layers import merge
from lowalt.files.yaml_files import load_yaml
from lowalt.workflow.run import Run
from lowalt.workflow.stages.accuracy_cost import AccuracyCostStage
from lowalt.workflow.stages.cost import CostStage
from lowalt.workflow.stages.echo import EchoStage
from lowalt.workflow.stages.motion import MotionStage
from lowalt.workflow.stages.noise import NoiseStage
from lowalt.workflow.stages.recognition import RecognitionStage
from lowalt.workflow.stages.report import ReportStage
from lowalt.workflow.stages.shards import ShardsStage
from lowalt.workflow.stages.targets import TargetsStage
from lowalt.workflow.stages.tiles import TilesStage

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
        self.targets = TargetsStage(self.run)
        self.motion = MotionStage(self.run)
        self.echo = EchoStage(self.run)
        self.noise = NoiseStage(self.run)
        self.tiles = TilesStage(self.run)
        self.shards = ShardsStage(self.run)
        self.recognition = RecognitionStage(self.run)
        self.cost = CostStage(self.run)
        self.accuracy_cost = AccuracyCostStage(self.run)
        self.page = ReportStage(self.run)


def run_of(overlay: dict | None = None, inputs: str | None = None) -> Run:
    """The run of the default configuration with an overlay on it."""
    return Run.of(merge(load_yaml("config/default.yaml"), overlay or {}), SCHEMA, inputs)


def stages_of(overlay: dict | None = None) -> Stages:
    """The stages of the run of an overlay."""
    return Stages(run_of(overlay))
