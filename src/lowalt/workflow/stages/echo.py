"""What the rules of echoes take, alone and in a scene: stations, network, tolerance and effects."""

from typing import Any

from lowalt.config.network import as_far_as
from lowalt.scene.set_noise import in_all_cells
from lowalt.workflow.stages.stage import RunStage, text


class EchoStage(RunStage):
    """Clean signals of a run's chunks; a job makes those of one station or of all stations."""

    def stations(self, wildcards: Any) -> list[str]:
        """Return the names of the stations whose signals one job makes."""
        if self._run.echo_per_station:
            return [wildcards.station]
        return self._run.stations

    def settings(self, wildcards: Any) -> str:
        """Return the network as far as it decides the job's station, and the echo's tolerance."""
        network = self._config["network"]
        station = getattr(wildcards, "station", None)
        if station:
            network = as_far_as(network, station)
        return text(network=network, tolerance=self._config["echo"]["tolerance"])

    def settings_in_scene(self, wildcards: Any) -> str:
        """Return what echoes in a scene depend on.

        It is the network, the echo's tolerance, the scene's effects with the SNRs of noise that
        they add, and the seed that they draw from.
        """
        blocks = self._blocks("seed", "network", "effects")
        blocks["tolerance"] = self._config["echo"]["tolerance"]
        if in_all_cells(self._config["effects"]):
            blocks |= self._config["noise"]
        return text(**blocks)
