"""One run: the facts derived from its checked configuration.

Other modules hold its files and its stages' settings. Every fault of a configuration is found here,
before any job starts.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from lowalt.config.classes import classes_of
from lowalt.config.layers import check
from lowalt.config.named_code import file_of
from lowalt.config.network import Network, station_names
from lowalt.files.atomic import slug
from lowalt.files.errors import InputError
from lowalt.recognition.schemes import Scheme
from lowalt.shards.plan import Plan
from lowalt.spectra import Spectra
from lowalt.targets.records import missing_inputs, records_of
from lowalt.tiles.image_settings import Images
from lowalt.workflow import refusals


@dataclass(frozen=True)
class Run:
    """Network, records, classes, plan and schemes of one run.

    inputs: the folder of the user's files, or None.
    The classes are those of the whole table of targets, so that labels do not depend on the
    selection of targets.
    """

    config: dict
    inputs: str | None
    network: Network
    records: dict[str, dict]
    classes: tuple[str, ...]
    plan: Plan
    schemes: dict[str, Scheme]

    @classmethod
    def of(cls, config: dict, schema: str | Path, inputs: str | None) -> "Run":
        """Return the run of a merged configuration.

        Raises: InputError naming the key, its value and the expected one, or the missing files of
        the user.
        """
        check(config, schema)
        refusals.refuse_braces(config, inputs)
        records = records_of(config["targets"], inputs)
        published = {name: record["published"] for name, record in records.items()}
        classes = classes_of(published)
        plan = Plan.of(config, published)
        subtypes = itertools.chain.from_iterable(plan.groups.values())
        chosen = {name: records[name] for name in subtypes}
        network = Network.from_settings(config["network"])
        spectra = Spectra.from_settings(config["spectra"])
        spectra.check(network.symbols, len(network.stations), network.subcarriers)
        Images.from_settings(config["images"])
        refusals.refuse_contradictions(config, published, classes)
        schemes = refusals.schemes_of(config)
        refusals.refuse_scene(config, chosen)
        refusals.refuse_no_files(config["targets"], inputs)
        lacking = missing_inputs(chosen, inputs)
        if lacking:
            raise InputError("missing inputs:\n  " + "\n  ".join(lacking))
        refusals.refuse_data(config)
        return cls(config, inputs, network, chosen, classes, plan, schemes)

    @property
    def sources(self) -> str:
        """One line: the number of built-in subtypes, and the names of those from files."""
        named = [
            name for name, record in self.records.items() if record["source"] in ("mesh", "mocap")
        ]
        if not named:
            return f"targets: {len(self.records)} built-in"
        return f"targets: {len(self.records) - len(named)} built-in; from files: {', '.join(named)}"

    @property
    def folding(self) -> str:
        """A line each where speeds of targets and their ranges fold, else an empty text."""
        speeds = self.network.folding(record["published"] for record in self.records.values())
        ranges = self.network.range_folding(self.config["motion"]["region"]["polygon_m"])
        return "\n".join(filter(None, (speeds, ranges)))

    @property
    def name(self) -> str:
        """Name of the run; its files are in results/{name}/."""
        return self.config["run"]

    @property
    def data(self) -> str:
        """Name of the run whose data set trains: this run, unless the configuration names one."""
        return self.config.get("data", self.name)

    @cached_property
    def stations(self) -> list[str]:
        """Names of the base stations, in the network's order."""
        return station_names(self.config["network"])

    @property
    def echo_per_station(self) -> bool:
        """Whether an echo job makes the signals of one station; otherwise those of all."""
        return self.config["echo"]["job"] == "station"

    @cached_property
    def subtypes(self) -> dict[str, str]:
        """Subtypes by the name of their files, in the plan's order."""
        return {slug(name): name for name in self.records}

    @cached_property
    def schemes_by_slug(self) -> dict[str, Scheme]:
        """Schemes trained or timed by the name of their folders."""
        return {scheme.slug: scheme for scheme in self.schemes.values()}

    def own_backbone(self, scheme: Scheme) -> str:
        """Return FILE.py:FUNCTION of a scheme's backbone, "" for a library's."""
        name = scheme.backbone_of(self.config["recognition"]["network"])
        return name if file_of(name) else ""

    @cached_property
    def trained(self) -> list[Scheme]:
        """Schemes that are trained, in the configuration's order."""
        return [self.schemes[name] for name in self.config["recognition"]["schemes"]]

    @cached_property
    def trainings(self) -> list[str]:
        """{protocol}/{scheme}/{training seed} of every training."""
        block = self.config["recognition"]
        names = []
        for scheme in self.trained:
            for protocol in block["protocols"]:
                if protocol in scheme.protocols:
                    names += [f"{protocol}/{scheme.slug}/{seed}" for seed in block["seeds"]]
        return names

    @cached_property
    def gpus(self) -> int:
        """Number of GPUs that a training or an evaluation asks the scheduler for."""
        return int(self.config["recognition"].get("gpu", False))

    @cached_property
    def priced(self) -> list[str]:
        """The trainings in the comparison of accuracy and cost: unseen protocol, all seeds."""
        names = []
        for scheme in self.trained:
            for seed in self.config["recognition"]["seeds"]:
                names.append(f"unseen/{scheme.slug}/{seed}")
        return names

    def is_made_by_tiles_stage(self, size: int) -> bool:
        """Return whether the tiles stage makes images of this size (pixels per side).

        Only runs with shards of images have a tiles stage.
        """
        return self.config["shards"]["kind"] == "image" and size in self.config["tiles"]["reduced"]

    def images_of_job(self, wildcards: Any) -> int:
        """Number of images per sample in the scheme of a job, which its time grows with."""
        return len(self.schemes_by_slug[wildcards.scheme].columns)

    @cached_property
    def image_sizes(self) -> list[int]:
        """Image sizes (pixels per side) of the trained schemes."""
        return sorted({self.pixels(scheme) for scheme in self.trained})

    def pixels(self, scheme: Scheme) -> int:
        """Image size (pixels per side) of a scheme's network."""
        return scheme.size or self.config["recognition"]["size"]
