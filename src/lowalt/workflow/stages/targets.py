"""What the rules of targets take: the user's files of a record, and the merged record."""

from typing import Any

from lowalt.targets.records import source_files
from lowalt.workflow.stages.stage import RunStage, text


class TargetsStage(RunStage):
    """Clouds and occluders of the subtypes of a run."""

    def _record(self, wildcards: Any) -> dict:
        """Return the merged record of one subtype."""
        return self._run.records[self._run.subtypes[wildcards.subtype]]

    def record_files(self, wildcards: Any) -> list[str]:
        """Return the user's mesh or recording files that the record of one subtype names."""
        return source_files(self._record(wildcards), self._run.inputs)

    def settings(self, wildcards: Any) -> str:
        """Return seed and record of one subtype."""
        return text(seed=self._config["seed"], record=self._record(wildcards))
