"""One run: the facts that follow from its checked configuration, and nothing about files or single stages.

Every fault of a configuration is found here, before any job starts.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from lowalt.common.classes import AIRBORNE, CATEGORIES, classes_of
from lowalt.common.config import check, plain
from lowalt.common.errors import InputError
from lowalt.common.files import slug
from lowalt.common.network import Network, station_names
from lowalt.common.plan import Plan
from lowalt.common.yaml_files import load_yaml
from lowalt.effects.set_noise import in_all_cells
from lowalt.recognition.schemes import Scheme, columns_in, named
from lowalt.shards.clean import refuse
from lowalt.spectra import Spectra
from lowalt.spectra.catalogue import named as spectra_named
from lowalt.targets.records import missing_inputs, records_of
from lowalt.tiles.settings import Images

TRAINING_BLOCKS = ("run", "data", "inputs", "cost", "recognition", "report")
"""Blocks of the configuration in which a run may differ from the run whose data set it trains on."""


@dataclass(frozen=True)
class Run:
    """Records, classes, plan and schemes of one run; `inputs` is the folder of meshes and recordings, or None.

    The classes are those of the whole table of targets, so that a label means the same however few are selected.
    """

    config: dict
    schema: Path
    inputs: str | None
    records: dict[str, dict]
    classes: tuple[str, ...]
    plan: Plan
    schemes: dict[str, Scheme]

    @classmethod
    def of(cls, config: dict, schema: str | Path, inputs: str | None) -> "Run":
        """Return the run of a merged configuration.

        Raises: InputError naming key, value and what was expected, or each file of the user's that is missing.
        """
        check(config, schema)
        records = records_of(config["targets"], inputs)
        published = {name: record["published"] for name, record in records.items()}
        classes, plan = classes_of(published), Plan.of(config, published)
        _check_heights(config["motion"]["height_m"], published, classes)
        chosen = {name: records[name] for members in plan.groups.values() for name in members}
        Spectra.from_settings(config["spectra"]).check(Network.from_settings(config["network"]).symbols)
        Images.from_settings(config["images"])
        block = config["recognition"]
        schemes = {
            name: named(block["table"], name, station_names(config["network"]))
            for name in (*block["schemes"], *block["timed"])
        }
        for name, scheme in schemes.items():
            columns_in(scheme.columns, spectra_named(config["spectra"]), len(config["network"]["stations"]), name)
        if config["run"] in block["transfer"]:
            raise InputError(f"recognition.transfer: {config['run']!r} is this run, expected other runs")
        _check_sizes(config)
        if config["effects"] or any("transmit" in place for place in config["network"]["stations"].values()):
            from lowalt.effects.checks import check as check_effects

            check_effects(config)
        lacking = missing_inputs(chosen, inputs)
        _check_some(config["targets"], inputs)
        if lacking:
            raise InputError("missing inputs:\n  " + "\n  ".join(lacking))
        _check_data(config)
        _check_input(config)
        if in_all_cells(config["effects"]) and any("snr_db" in step for step in config.get("added", [])):
            raise InputError("added: snr_db beside effects.cell_noise, whose echoes hold the noise of all SNRs")
        for name in block.get("extra", []):
            _check_extra(config, name, classes)
        return cls(config, Path(schema), inputs, chosen, classes, plan, schemes)

    @property
    def sources(self) -> str:
        """One line on what the clouds are made from: built-in models, and each subtype of a file of the user's."""
        own = [name for name, record in self.records.items() if record["source"] in ("mesh", "mocap")]
        if not own:
            return f"targets: {len(self.records)} built-in"
        return f"targets: {len(self.records) - len(own)} built-in; from files: {', '.join(own)}"

    @property
    def name(self) -> str:
        """Name of the run; all it makes lies in results/{name}/."""
        return self.config["run"]

    @property
    def data(self) -> str:
        """Name of the run whose data set this run trains on: its own, unless the configuration names another."""
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

    @cached_property
    def trained(self) -> list[Scheme]:
        """Schemes that are trained, in the configuration's order."""
        return [self.schemes[name] for name in self.config["recognition"]["schemes"]]

    @cached_property
    def trainings(self) -> list[str]:
        """{protocol}/{scheme}/{training seed} of every training."""
        block = self.config["recognition"]
        return [
            f"{protocol}/{scheme.slug}/{seed}"
            for scheme in self.trained
            for protocol in block["protocols"]
            if protocol in scheme.protocols
            for seed in block["seeds"]
        ]

    @property
    def processes(self) -> int:
        """Processes that share one training."""
        return self.config["recognition"].get("processes", 1)

    @property
    def launcher(self) -> str:
        """The words between `python -m` and the training's module: torchrun's own module for several processes."""
        alone = self.processes == 1
        return "" if alone else f"torch.distributed.run --standalone --nproc-per-node {self.processes} -m"

    @cached_property
    def priced(self) -> list[str]:
        """The trainings whose accuracy is set against their cost: the unseen protocol, the first training seed."""
        return [f"unseen/{scheme.slug}/{self.config['recognition']['seeds'][0]}" for scheme in self.trained]

    @cached_property
    def asked(self) -> Scheme:
        """The scheme whose network shows what effects do: that of the most images, trained on all subtypes.

        Raises: InputError where no scheme is trained in the protocol "seen".
        """
        protocols = self.config["recognition"]["protocols"]
        able = [scheme for scheme in self.trained if "seen" in scheme.protocols and "seen" in protocols]
        if not able:
            raise InputError(
                "recognition.schemes: none is trained in the protocol 'seen', expected one to ask about effects"
            )
        return max(able, key=lambda scheme: len(scheme.columns))

    def is_reduced(self, size: int) -> bool:
        """Whether the tiles stage reduces its images to this size; signal shards have no tiles."""
        return self.config["shards"]["kind"] == "image" and size in self.config["tiles"]["reduced"]

    def images_of_job(self, wildcards: Any) -> int:
        """Images of one sample that the scheme of a job sees: its training takes time in proportion."""
        return len(self.schemes_by_slug[wildcards.scheme].columns)

    def pixels(self, scheme: Scheme) -> int:
        """Pixels a side that a scheme's network sees."""
        return scheme.size or self.config["recognition"]["size"]


def _check_sizes(config: dict) -> None:
    """Refuse sizes of motion models that are no ranges, or that come with effects, which use the clouds' own sizes."""
    sizes = config["motion"].get("sizes_m", {})
    for category, (low, high) in sizes.items():
        if low > high:
            raise InputError(f"motion.sizes_m: {category} from {low} to {high} m, expected the smaller size first")
    if sizes and config["effects"]:
        raise InputError(
            f"motion.sizes_m: given together with effects {sorted(config['effects'])}, expected one or the other"
        )


def _check_input(config: dict) -> None:
    """Refuse samples made on the spot with a cache of the shards' images, and clean echoes of a scene without any."""
    if config["shards"]["kind"] == "recipe":
        refuse(config["effects"])
    block = config["recognition"]
    if block.get("input") == "dataset" and block["cache"]:
        raise InputError("recognition.input: 'dataset' together with recognition.cache true, expected cache: false")


def _check_extra(config: dict, name: str, classes: tuple[str, ...]) -> None:
    """Refuse a run to train on that is not there, whose samples differ in form, or that may hold tested samples."""
    made = Path("results") / name / "config.yaml"
    if name in (config["run"], config.get("data")) or not made.is_file():
        raise InputError(f"recognition.extra: {name!r}, expected another, finished run; no {made} or it is this run")
    if not config["recognition"]["cache"]:
        raise InputError("recognition.extra: given without recognition.cache, expected true")
    own, other = plain(config), plain(load_yaml(made))
    differ = [key for key in ("network", "spectra", "images") if own[key] != other[key]]
    if differ:
        raise InputError(f"recognition.extra: run {name!r} has other settings of {differ}, expected equal ones")
    others = classes_of({name: record["published"] for name, record in records_of(other["targets"]).items()})
    if others != classes:
        raise InputError(f"recognition.extra: run {name!r} has the classes {others}, expected {classes}")
    if own["seed"] == other["seed"]:
        raise InputError(
            f"recognition.extra: run {name!r} has this run's seed {own['seed']}, so its motion models would be those "
            "that are tested; expected another seed"
        )


def _check_some(targets: dict, inputs: str | None) -> None:
    """Refuse a folder of inputs without any file that records name, where built-in models may take their places."""
    if targets.get("where_missing") != "builtin":
        return
    named = records_of({**targets, "where_missing": "refuse"})
    real = {name: record for name, record in named.items() if record["source"] in ("mesh", "mocap")}
    lacking = [name for name, record in real.items() if missing_inputs({name: record}, inputs)]
    if real and len(lacking) == len(real):
        raise InputError(f"inputs: {inputs}, expected a folder with the files of at least one of {lacking}")


def _check_heights(heights: dict, published: dict, classes: tuple[str, ...]) -> None:
    """Refuse flight heights of what is neither a subtype nor a class."""
    unknown = sorted(set(heights) - {*published, *classes, *CATEGORIES})
    if unknown:
        raise InputError(f"motion.height_m: {unknown}, expected subtypes, classes {list(classes)} or {list(AIRBORNE)}")


def _check_data(config: dict) -> None:
    """Refuse another run's data set that is not there or was made with other settings than this configuration's."""
    name = config.get("data", config["run"])
    if name == config["run"]:
        return
    made = Path("results") / name / "config.yaml"
    if not made.is_file():
        raise InputError(f"data: no {made}, expected a finished run; make run {name!r} first")
    own, other = plain(config), plain(load_yaml(made))
    differ = [key for key in sorted({*own, *other} - set(TRAINING_BLOCKS)) if own.get(key) != other.get(key)]
    if differ:
        raise InputError(f"data: run {name!r} was made with other settings of {differ}, expected equal ones")
