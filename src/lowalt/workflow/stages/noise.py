"""What the rule of noise takes: the SNRs of a chunk, and the scene's filters."""

from typing import Any

from lowalt.scene.effects import dotted
from lowalt.scene.set_noise import filters
from lowalt.workflow.stages.stage import RunStage, text


class NoiseStage(RunStage):
    """Noisy signals of a run's chunks."""

    @property
    def modules(self) -> list[str]:
        """The modules that the stage loads in a scene whose filters the noise passes."""
        passed = filters(self._config["effects"])
        if not passed:
            return []
        return ["lowalt.scene.set_noise", *map(dotted, passed)]

    def settings(self, wildcards: Any) -> str:
        """Return the SNRs, the names of the stations, and the filters that noise passes."""
        blocks = self._blocks("seed")
        passed = filters(self._config["effects"])
        if passed:
            blocks["filters"] = passed
        return text(**blocks, stations=self._run.stations, snr_db=self._snrs(wildcards))
