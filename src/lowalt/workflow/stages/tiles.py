"""What the rule of tiles takes: spectra, images, and what cubes and late symbols are made of."""

from pathlib import Path
from typing import Any

from lowalt.scene.effects import dotted
from lowalt.scene.lateness import late_effects
from lowalt.spectra.catalogue import of_cells
from lowalt.workflow.run import Run
from lowalt.workflow.stages.stage import RunStage, option, text


class TilesStage(RunStage):
    """Tiles of a run's chunks, and their images of reduced sizes."""

    def __init__(self, run: Run) -> None:
        super().__init__(run)
        self._late = late_effects(run.config)
        self.shows_cells = bool(of_cells(run.config["spectra"]))
        """Whether spectra show range cells, which are made again from clouds and surfaces."""
        self.reads_motion = self.shows_cells or bool(self._late)
        """Whether spectra show range cells or know the instants of late symbols."""

    @property
    def modules(self) -> list[str]:
        """The modules that the stage loads for late symbols and for range cells."""
        modules = []
        if self._late:
            modules += ["lowalt.scene.lateness", "lowalt.motion", *map(dotted, self._late)]
        if self.shows_cells:
            modules += ["lowalt.tiles.cubes", *map(dotted, self._config["effects"])]
        return modules

    def settings(self, wildcards: Any) -> str:
        """Return network, spectra and images, and what else the images of a chunk depend on.

        That is what late symbols are drawn from, where spectra know their instants, and what range
        cells are made from, where spectra show them.
        """
        blocks = self._blocks("network", "spectra", "images")
        if self._late:
            blocks["drawn"] = {"seed": self._config["seed"], "effects": self._late}
        if self.shows_cells:
            cubes = self._blocks("seed", "effects")
            cubes["tolerance"] = self._config["echo"]["tolerance"]
            cubes["snr_db"] = self._snrs(wildcards)
            blocks["cubes"] = cubes
        return text(**blocks)

    def reduced(self, wildcards: Any, output: Any) -> list[str]:
        """Return the option that names the reduced images of a chunk by their size.

        The size is the name of their folder.
        """
        return option("reduced", [f"{Path(path).parent.name}={path}" for path in output.reduced])
