"""What the rules of the report take: the files of its page, by the names of its manifest."""

import json
from typing import Any

from lowalt.config.extensions import offered
from lowalt.files.package_plan import PACKAGE
from lowalt.files.shipped import as_named, shipped
from lowalt.report.inputs import KEPT
from lowalt.workflow.sources import code, file_of, near
from lowalt.workflow.stages.accuracy_cost import data_jobs
from lowalt.workflow.stages.stage import RunStage, text

REFERENCE = "results/reference"
PAGE = (".html", ".css", ".js")
"""Suffixes of the templates of the report."""
TABLES = ("accuracy", "confusion_by_snr", "subtypes", "comparisons", "orderings", "seeds")
"""Tables of recognition that the report shows."""


class ReportStage(RunStage):
    """The page of a run."""

    def files(self, wildcards: Any) -> dict[str, str | list[str]]:
        """Return the files of the report by the names of its manifest (`lowalt.report.inputs`).

        Existence is checked only of files that no rule of the run can make.
        """
        own = f"results/{wildcards.run}"
        data = f"results/{self._run.data}"
        block = self._config["report"]
        trainings = self._run.trainings
        files: dict[str, str | list[str]] = {name: f"{own}/{name}.csv" for name in TABLES}
        files["published"] = block["published"]
        files["index"] = f"{data}/shards/index.json"
        files["clouds"] = [f"{data}/clouds/{subtype}.npz" for subtype in self._run.subtypes]
        files["distances"] = f"{data}/distances.csv"
        files["benchmarks"] = self._benchmarks(own, data)
        if self._config["recognition"]["transfer"]:
            files["transfer"] = f"{own}/transfer.csv"
        for name, file in KEPT.items():
            kept = shipped(f"{REFERENCE}/{file}")
            if kept.is_file():
                files[f"kept_{name}"] = str(kept)
        # A benchmark's data set has a kept table of baselines.
        baselines = shipped(f"{REFERENCE}/{self._run.data}/table.csv")
        if baselines.is_file():
            files["benchmark"] = str(baselines)
        if trainings:
            files["predictions"] = [f"{own}/predictions/{training}.csv" for training in trainings]
        if block["accuracy"]:
            files["accuracy_cost"] = block["accuracy"]
        if block["cost"]:
            files["echo_cost"] = block["cost"]
        return files

    def _benchmarks(self, own: str, data: str) -> list[str]:
        """Return the measurements of all jobs, in pipeline order.

        own, data: folders of the run and of the run of its data set.
        """
        paths = [f"{data}/benchmarks/{job}.jsonl" for job in data_jobs(self._run)]
        for rule in ("train", "evaluate"):
            for training in self._run.trainings:
                paths.append(f"{own}/benchmarks/{rule}/{training}.jsonl")
        paths.append(f"{data}/benchmarks/distances.jsonl")
        paths.append(f"{own}/benchmarks/tables.jsonl")
        return paths

    def manifest(self, wildcards: Any) -> str:
        """Return the files of the report as the JSON text of its manifest."""
        return json.dumps(self.files(wildcards), indent=1)

    def added_sections(self, wildcards: Any) -> list[str]:
        """Return the source files and templates of sections that extensions add to this page."""
        files = self.files(wildcards)
        modules = [module for name, module in offered("sections").items() if name in files]
        templates = [near(file_of(module).with_suffix(".html")) for module in modules]
        return [*code(*modules), *templates]

    @property
    def templates(self) -> list[str]:
        """Templates, style and scripts of the page."""
        paths = sorted((PACKAGE / "report").rglob("*"))
        return [near(path) for path in paths if path.suffix in PAGE]

    def settings(self, wildcards: Any) -> str:
        """Return the whole configuration, and the published values of each subtype."""
        return text(config=as_named(self._config), published=self._published)
