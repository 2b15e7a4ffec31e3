"""What the rules of recognition's cost take: measured jobs, and predictions that studies make."""

from pathlib import Path
from typing import Any

from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.workflow.run import Run
from lowalt.workflow.stages.stage import RunStage


def data_jobs(run: Run) -> list[str]:
    """Return the measured jobs of a run's data set in pipeline order, as names of their files."""
    plan = run.plan
    kind = run.config["shards"]["kind"]
    jobs = [f"cloud/{subtype}" for subtype in run.subtypes]
    jobs += [f"motion/{chunk}" for chunk in plan.sources]
    if run.echo_per_station:
        for chunk in plan.sources:
            jobs += [f"echo/{chunk}-{station}" for station in run.stations]
    else:
        jobs += [f"echo/{chunk}" for chunk in plan.sources]
    if kind != "recipe":
        jobs += [f"noise/{chunk}" for chunk in plan.chunks]
    if kind == "image":
        jobs += [f"tiles/{chunk}" for chunk in plan.chunks]
    jobs += [f"shard/{shard}" for shard in plan.shards]
    jobs.append("index")
    if run.config["recognition"]["cache"]:
        for size in run.image_sizes:
            jobs += [f"views/{size}/{shard}" for shard in plan.shards]
    return jobs


class AccuracyCostStage(RunStage):
    """Accuracy of recognition against computing time."""

    @property
    def presets(self) -> str:
        """The presets for the cost of recognition, some of which a study trains."""
        return str(shipped("config/cost/presets.csv"))

    @property
    def data_jobs(self) -> list[str]:
        """The measured jobs of the data set, in pipeline order."""
        return data_jobs(self._run)

    def studied(self, wildcards: Any) -> list[str]:
        """Return the predictions of the presets that a study trains on this run's data.

        There is one file per training seed. Raises: InputError naming the command that makes them,
        where one is missing.
        """
        paths = []
        for row in read_csv(self.presets, "command", "predictions"):
            if not row["predictions"]:
                continue
            for seed in self._config["recognition"]["seeds"]:
                path = f"results/{self._run.data}-{row['predictions']}/{seed}.csv"
                if not Path(path).is_file():
                    raise InputError(f"no {path}: `{row['command']}` makes it first")
                paths.append(path)
        return paths
