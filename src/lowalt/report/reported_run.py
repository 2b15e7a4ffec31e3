"""The run that the sections of the page show: its files, its configuration and its shards."""

from lowalt.config.blocks import snrs_of
from lowalt.config.network import station_names
from lowalt.report.inputs import Inputs
from lowalt.shards import ShardSet


class ReportedRun:
    """The run that a page shows."""

    def __init__(self, inputs: Inputs, config: dict, targets: dict[str, dict]) -> None:
        """Take what the page of a run is made of.

        inputs: the run's files; config: its configuration; targets: row of the table of targets by
        subtype.
        """
        self.inputs = inputs
        self.config = config
        self.targets = targets
        self.shards = ShardSet(inputs.path("index"))

    @property
    def sample_bytes(self) -> float:
        """Bytes per sample in the shards."""
        return sum(shard["bytes"] for shard in self.shards.shards) / len(self.shards)

    @property
    def snr_labels(self) -> list[str]:
        """The run's SNRs (dB) as the tables write them."""
        return [f"{snr:g}" for snr in snrs_of(self.config)]

    @property
    def stations(self) -> list[str]:
        """Names of the base stations, in the network's order."""
        return station_names(self.config["network"])
