"""The settings of each stage as one JSON text with only the values that the stage reads.

Snakemake compares these texts, so a changed value re-runs only the stages that read it. Each method
takes the wildcards of a job and can stand in a rule's `params:`.
"""

from typing import Any

from lowalt.config.layers import canonical
from lowalt.config.network import as_far_as, masts_m
from lowalt.config.plan import Chunk, motion_block
from lowalt.files.shipped import as_named
from lowalt.motion.drawing import masts_in_reach
from lowalt.scene.lateness import late_effects
from lowalt.scene.set_noise import filters, in_all_cells
from lowalt.spectra.catalogue import of_cells
from lowalt.workflow.run import Run

MOTION = ("region", "height_m", "tilt_deg", "cadence", "sizes_m", "looks", "look_s", "track")
"""Keys of the block `motion` that determine the draws; those from `sizes_m` on are optional."""


def _text(**block: Any) -> str:
    """The JSON text of a block."""
    return canonical(block)


class Settings:
    """Settings of the stages of one run."""

    def __init__(self, run: Run) -> None:
        """Keep the run."""
        self._run = run
        self._config = run.config

    def _blocks(self, *names: str) -> dict:
        """Blocks of the configuration by name."""
        return {name: self._config[name] for name in names}

    @property
    def _published(self) -> dict[str, dict]:
        """Rows of the table of targets by subtype."""
        return {name: record["published"] for name, record in self._run.records.items()}

    def _chunk(self, wildcards: Any) -> Chunk:
        """The chunk of a job."""
        return self._run.plan.chunk(f"{wildcards.group}-{wildcards.part}")

    def _snrs(self, wildcards: Any) -> list[float]:
        """SNRs (dB) of a job's chunk, as the configuration writes them."""
        steps = [self._config["noise"], *self._config.get("added", [])]
        written = {float(snr): snr for step in steps for snr in step.get("snr_db", [])}
        return [written[snr] for snr in self._chunk(wildcards).snrs]

    def configuration(self, wildcards: Any) -> str:
        """The whole configuration."""
        return _text(**as_named(self._config))

    def cloud(self, wildcards: Any) -> str:
        """Seed and the merged record of one subtype; occluders read the same."""
        record = self._run.records[self._run.subtypes[wildcards.subtype]]
        return _text(seed=self._config["seed"], record=record)

    def motion(self, wildcards: Any) -> str:
        """Data that a chunk's motion models are drawn from: region, masts in its reach, ranges of
        its subtypes.
        """
        block = motion_block(self._config)
        members = self._chunk(wildcards).members
        return _text(
            seed=self._config["seed"],
            masts_m=masts_in_reach(masts_m(self._config["network"]), **block["region"]),
            motion={key: block[key] for key in MOTION if key in block},
            published={name: self._run.records[name]["published"] for name in members},
        )

    def echo(self, wildcards: Any) -> str:
        """The network as far as it decides the job's station, and the echo's tolerance."""
        tolerance = self._config["echo"]["tolerance"]
        station = getattr(wildcards, "station", None)
        network = (
            as_far_as(self._config["network"], station) if station else self._config["network"]
        )
        return _text(network=network, tolerance=tolerance)

    def echo_in_scene(self, wildcards: Any) -> str:
        """The network, the echo's tolerance, the scene's effects with their SNRs, and the seed that
        they draw from.
        """
        tolerance = self._config["echo"]["tolerance"]
        inside = self._blocks("noise")["noise"] if in_all_cells(self._config["effects"]) else {}
        return _text(**self._blocks("seed", "network", "effects"), tolerance=tolerance, **inside)

    def noise(self, wildcards: Any) -> str:
        """The set of SNRs, the names of the stations, and the scene's filters, which the noise
        passes.
        """
        snrs = self._snrs(wildcards)
        passed = filters(self._config["effects"])
        return _text(
            **self._blocks("seed"),
            stations=self._run.stations,
            snr_db=snrs,
            **({"filters": passed} if passed else {}),
        )

    def images(self, wildcards: Any) -> str:
        """Network, spectra and images; what late symbols are drawn from, where spectra know their
        instants; what range cells are made from, where spectra show them."""
        blocks = self._blocks("network", "spectra", "images")
        if late := late_effects(self._config):
            blocks["drawn"] = {"seed": self._config["seed"], "effects": late}
        if not of_cells(self._config["spectra"]):
            return _text(**blocks)
        snrs = self._snrs(wildcards)
        tolerance = self._config["echo"]["tolerance"]
        cubes = {**self._blocks("seed", "effects"), "tolerance": tolerance, "snr_db": snrs}
        return _text(**blocks, cubes=cubes)

    def index(self, wildcards: Any) -> str:
        """How motion becomes echoes and signals become tiles: with these and the clouds a sample
        can be made again.
        """
        echo = {"tolerance": self._config["echo"]["tolerance"], "effects": self._config["effects"]}
        blocks = self._blocks("network", "spectra", "images")
        return _text(**blocks, echo=echo, classes=self._run.classes)

    def shard(self, wildcards: Any) -> str:
        """The fold of each sample, its name and its form, and the companions and paths that its
        record names.
        """
        snrs = self._snrs(wildcards)
        effects = self._config["effects"]
        added = {name: effects[name] or {} for name in ("companions", "town") if name in effects}
        if self._config["shards"]["kind"] == "recipe" and "canceller" in effects:
            added["canceller"] = effects["canceller"] or {}
        if self._config["shards"]["kind"] == "cube":
            added["echo"] = {"tolerance": self._config["echo"]["tolerance"], "effects": effects}
        blocks = self._blocks("seed", "network", "split", "shards")
        return _text(**blocks, snr_db=snrs, classes=self._run.classes, **added)

    def cost_table(self, wildcards: Any) -> str:
        """Settings with which the echo is timed, and the rows of the table of targets."""
        blocks = self._blocks("network", "motion", "seed", "cost")
        return _text(**blocks, published=self._published)

    def views(self, wildcards: Any) -> str:
        """Pixels a side of the shrunk images; the SNRs too, where the tiles stage makes them for a
        whole chunk.
        """
        size = int(wildcards.size)
        snrs = self._snrs(wildcards)
        more = {"snr_db": snrs} if self._run.is_reduced(size) else {}
        return _text(size=size, **more)

    def training(self, wildcards: Any) -> str:
        """Settings of a training with its scheme, and its training seed or, if the job has none,
        the run's seed.
        """
        block = self._config["recognition"]
        scheme = self._run.schemes_by_slug[wildcards.scheme].record
        kept = {key: block[key] for key in ("size", "network", "training", "augmentation")}
        kept |= {
            "scheme": scheme,
            "colour_map": self._config["images"]["colour_map"],
            "classes": self._run.classes,
        }
        return _text(seed=int(wildcards.get("train_seed", self._config["seed"])), **kept)

    def evaluation(self, wildcards: Any) -> str:
        """Settings with which a network predicts."""
        return _text(**self._config["recognition"]["evaluation"])

    def backbone(self, wildcards: Any) -> list[str]:
        """Command-line words that name the user's code of a scheme's backbone; empty for a
        library's.
        """
        name = self._run.own_backbone(self._run.schemes_by_slug[wildcards.scheme])
        return ["--backbone", name] if name else []

    def seed(self, wildcards: Any) -> str:
        """Only the run's seed, for tables with intervals."""
        return _text(**self._blocks("seed"))

    def report(self, wildcards: Any) -> str:
        """The whole configuration, and the published values of each subtype."""
        return _text(config=as_named(self._config), published=self._published)
