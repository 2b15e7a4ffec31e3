"""What the rules of the echo's cost take: the first subtype of each category, and the settings."""

from typing import Any

from lowalt.files.atomic import slug
from lowalt.workflow.stages.stage import RunStage, text


class CostStage(RunStage):
    """Error of the echo against computing time."""

    @property
    def first_subtypes(self) -> list[str]:
        """The file names of the first subtype of each category, in the table's order."""
        first: dict[str, str] = {}
        for name, published in self._published.items():
            first.setdefault(published["category"], slug(name))
        return list(first.values())

    def settings(self, wildcards: Any) -> str:
        """Return settings with which the echo is timed, and the rows of the table of targets."""
        blocks = self._blocks("network", "motion", "seed", "cost")
        return text(**blocks, published=self._published)
