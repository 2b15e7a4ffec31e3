"""What the rules of shards take: the kind of shards, their settings, the data card's template."""

from typing import Any

from lowalt.files.package_plan import PACKAGE
from lowalt.files.shipped import as_named
from lowalt.scene.effects import dotted, of_record
from lowalt.scene.set_noise import filters
from lowalt.workflow.run import Run
from lowalt.workflow.sources import near
from lowalt.workflow.stages.stage import RunStage, text


class ShardsStage(RunStage):
    """Shards of a run's chunks and folds, their index, the data card and the configuration."""

    def __init__(self, run: Run) -> None:
        super().__init__(run)
        self.kind = run.config["shards"]["kind"]

    @property
    def modules(self) -> list[str]:
        """The modules of effects that the stage loads.

        These are all where it makes cubes, otherwise those that add to records.
        """
        effects = self._config["effects"]
        loaded = effects if self.kind == "cube" else of_record(effects)
        return [dotted(name) for name in loaded]

    def settings(self, wildcards: Any) -> str:
        """Return a sample's fold, name and form, and what its record says of the scene."""
        effects = self._config["effects"]
        added: dict[str, Any] = {}
        recorded = of_record(effects)
        if recorded:
            added["record"] = recorded
        passed = filters(effects)
        if self.kind == "recipe" and passed:
            added["filters"] = passed
        if self.kind == "cube":
            added["echo"] = {"tolerance": self._config["echo"]["tolerance"], "effects": effects}
        blocks = self._blocks("seed", "network", "split", "shards")
        return text(**blocks, snr_db=self._snrs(wildcards), classes=self._run.classes, **added)

    def piece(self, wildcards: Any) -> list[str]:
        """Return the number of a shard among the pieces of its chunk's fold, as words of a command.

        A single piece has none.
        """
        pieces = self._run.plan.pieces(f"{wildcards.group}-{wildcards.part}", wildcards.fold)
        if len(pieces) == 1:
            return []
        return ["--piece", str(pieces.index(wildcards.piece)), str(len(pieces))]

    def index_settings(self, wildcards: Any) -> str:
        """Return how motion becomes echoes and signals become tiles.

        With these and the clouds a sample can be made again.
        """
        echo = {"tolerance": self._config["echo"]["tolerance"], "effects": self._config["effects"]}
        blocks = self._blocks("network", "spectra", "images")
        return text(**blocks, echo=echo, classes=self._run.classes)

    @property
    def card_template(self) -> str:
        """The text of the data card."""
        return near(PACKAGE / "shards/card.md.jinja")

    def configuration(self, wildcards: Any) -> str:
        """Return the whole configuration."""
        return text(**as_named(self._config))
