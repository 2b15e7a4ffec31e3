"""A run of the default configuration with an overlay: its facts, its files and its settings."""

from pathlib import Path

from lowalt.config.layers import merge
from lowalt.files.yaml_files import load_yaml
from lowalt.workflow.products import Products
from lowalt.workflow.run import Run
from lowalt.workflow.stage_settings import Settings

ROOT = Path(__file__).parents[2]
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"


class Inputs(dict):
    """A job's inputs by name, read as items or attributes, as Snakemake gives them."""

    __getattr__ = dict.__getitem__


def run_of(overlay: dict | None = None, inputs: str | None = None) -> Run:
    """The run of the default configuration with an overlay on it."""
    return Run.of(merge(load_yaml("config/default.yaml"), overlay or {}), SCHEMA, inputs)


def parts(overlay: dict | None = None) -> tuple[Run, Products, Settings]:
    """The run of an overlay, the files it makes, and the settings of its stages."""
    run = run_of(overlay)
    return run, Products(run), Settings(run)
