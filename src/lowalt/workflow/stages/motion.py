"""What the rule of motion takes: the flight log, and what motion models are drawn from."""

from typing import Any

from lowalt.config.blocks import motion_block
from lowalt.config.network import masts_m
from lowalt.motion.drawing import masts_in_reach
from lowalt.workflow.stages.stage import RunStage, text

DRAWN = ("region", "height_m", "tilt_deg", "cadence", "sizes_m", "looks", "look_s", "track")
"""Keys of the block `motion` that determine the draws; those from `sizes_m` on are optional."""


class MotionStage(RunStage):
    """Tables of motion models of a run's chunks."""

    @property
    def track(self) -> list[str]:
        """The flight log whose path motion models follow; none where paths are drawn."""
        block = self._config["motion"]
        if "track" not in block:
            return []
        return [block["track"]]

    def settings(self, wildcards: Any) -> str:
        """Return what motion models are drawn from: region, masts in reach, subtypes' ranges."""
        block = motion_block(self._config)
        members = self._chunk(wildcards).members
        return text(
            seed=self._config["seed"],
            masts_m=masts_in_reach(masts_m(self._config["network"]), **block["region"]),
            motion={key: block[key] for key in DRAWN if key in block},
            published={name: self._run.records[name]["published"] for name in members},
        )

    def span(self, wildcards: Any) -> list[str]:
        """Return the motion models of a chunk within its group, as words of the command."""
        chunk = self._chunk(wildcards)
        return ["--first", str(chunk.first), "--count", str(chunk.count)]
