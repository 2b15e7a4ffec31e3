"""The jobs that Snakemake plans for a configuration, with their inputs and parameters; none runs."""

import json
import os
from pathlib import Path
from typing import NamedTuple

from lowalt.config.layers import merge
from snakemake_runs import run

ROOT = Path(__file__).parents[2]
FEW = {
    "targets": {"select": ["DJI Mini 2", "Crow", "Owl", "NIO ET5T 2023", "Walking Pedestrian 5"]},
    "motion": {"models": 100},
}
"""Fewer jobs than those of the default, of each rule and group."""
BEFOREHAND = f"""
sys.path[:0] = [{str(ROOT / "src")!r}, {str(ROOT / "tests/support")!r}]
import kept_records
from lowalt.config.layers import overlaid
from lowalt.targets import records
from lowalt.workflow import sources
from lowalt.workflow.run import Run

records.merge = kept_records.once(records.merge)
Run.of(overlaid([]), {str(ROOT / "workflow/schemas/config.schema.yaml")!r}, None)
for path in sources.PACKAGE.rglob("*.py"):
    sources._imports(path, sources.PACKAGE.name)
"""
"""What each plan would do anew: import the package, merge its records and look for imports."""
PROGRAM = """
import json
from pathlib import Path
from snakemake.api import SnakemakeApi
from snakemake.settings.types import ConfigSettings, DAGSettings, OutputSettings, ResourceSettings

def listed(held):
    return [str(path) for path in ([held] if isinstance(held, str) else held)]

asked = json.loads(Path("asked.json").read_text())
with SnakemakeApi(OutputSettings(dryrun=True)) as api:
    configuration = ConfigSettings(config=asked["overlay"], configfiles=[Path("config/default.yaml")])
    workflow = api.workflow(ResourceSettings(cores=2), configuration, snakefile=Path("Snakefile"))
    dag = workflow.dag(DAGSettings(targets=set(asked["targets"]), forceall=True))
    dag.execute_workflow(executor="dryrun")
    found = []
    for job in workflow._workflow.dag.jobs:
        inputs = {name: listed(job.input.get(name)) for name in job.input.keys()}
        params = {name: job.params.get(name) for name in job.params.keys()}
        for name, held in params.items():
            params[name] = held if isinstance(held, str) else listed(held)
        found.append([job.rule.name, dict(job.wildcards_dict), listed(job.input), inputs, params])
Path("found.json").write_text(json.dumps(found))
"""


class Job(NamedTuple):
    """One job: its rule, wildcards, all input files, and inputs and parameters by name."""

    rule: str
    wildcards: dict[str, str]
    files: list[str]
    inputs: dict[str, list[str]]
    params: dict[str, str | list[str]]


def place(folder: Path) -> Path:
    """Return a folder in which the project's workflow can be planned."""
    for name in ("workflow", "config", "profiles", "src", "envs", "Snakefile"):
        (folder / name).symlink_to(ROOT / name)
    return folder


def planned(folder: Path, overlay: dict, *targets: str) -> list[Job]:
    """Return the jobs of an overlay on `FEW`, each planned anew; targets: rules or files.

    folder: a `place`.
    """
    asked = {"overlay": merge(FEW, overlay), "targets": targets}
    (folder / "asked.json").write_text(json.dumps(asked))
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    environment.pop("LOWALT_INPUTS", None)
    status, text = run(folder, [], environment, PROGRAM, BEFOREHAND)
    assert status == 0, text[-4000:]
    return [Job(*job) for job in json.loads((folder / "found.json").read_text())]


def job_of(jobs: list[Job], rule: str, **wildcards: str) -> Job:
    """Return the one job of a rule with these wildcards among others."""
    (found,) = [
        job for job in jobs if job.rule == rule and wildcards.items() <= job.wildcards.items()
    ]
    return found
