"""Refusals of configurations whose values contradict each other, other runs or the files that are there.

Each function raises InputError that names key, value and what was expected. `Run.of` calls them before any job starts.
"""

from collections.abc import Collection
from pathlib import Path

from lowalt.common.classes import AIRBORNE, CATEGORIES, classes_of
from lowalt.common.config import plain
from lowalt.common.errors import InputError
from lowalt.common.shipped import SHIPPED, as_named, located
from lowalt.common.yaml_files import load_yaml
from lowalt.recognition.protocols import folds
from lowalt.recognition.schemes import Scheme
from lowalt.shards.clean import refuse
from lowalt.spectra.catalogue import named, profiled
from lowalt.targets.records import missing_inputs, records_of

TRAINING_BLOCKS = ("run", "data", "inputs", "cost", "recognition", "report")
"""Blocks of the configuration that may differ between a run and the run whose data set it trains on."""


def refuse_braces(config: dict, inputs: str | None) -> None:
    """Refuse paths with braces, which Snakemake takes for a wildcard or a format."""
    keys = (("recognition", "table"), ("report", "published"), ("report", "accuracy"), ("report", "measured"))
    paths = {"inputs": inputs, "the folder of lowalt": str(SHIPPED)}
    paths |= {f"{block}.{key}": config[block][key] for block, key in keys}
    for name, path in paths.items():
        if path and {"{", "}"} & {*path}:
            raise InputError(f"{name}: {path!r}, expected a path without braces")


def refuse_companions(config: dict, subtypes: Collection[str]) -> None:
    """Refuse companions that the run does not have."""
    named = (config["effects"].get("companions") or {}).get("subtypes", [])
    if unknown := sorted(set(named) - set(subtypes)):
        raise InputError(f"effects.companions.subtypes: {unknown}, expected subtypes of the run")


def refuse_sizes(config: dict, classes: tuple[str, ...] = tuple(CATEGORIES)) -> None:
    """Refuse sizes of unknown classes or whose range is reversed, and sizes together with effects."""
    sizes = config["motion"].get("sizes_m", {})
    if set(sizes) - set(classes):
        raise InputError(f"motion.sizes_m: {sorted(sizes)}, expected some of the classes {list(classes)}")
    for category, (low, high) in sizes.items():
        if low > high:
            raise InputError(f"motion.sizes_m: {category} from {low} to {high} m, expected the smaller size first")
    if sizes and config["effects"]:
        raise InputError(
            f"motion.sizes_m: given together with effects {sorted(config['effects'])}, expected one or the other"
        )


def refuse_input(config: dict) -> None:
    """Refuse a cache of images for samples made on the spot, and shards of clean echoes in scenes that have none."""
    if config["shards"]["kind"] == "recipe":
        refuse(config["effects"])
    block = config["recognition"]
    if block.get("input") == "dataset" and block["cache"]:
        raise InputError("recognition.input: 'dataset' together with recognition.cache true, expected cache: false")


def refuse_profiles(config: dict) -> None:
    """Refuse range profiles where no stage makes them: in scenes, of links, and of shards that hold signals alone."""
    if not profiled(config["spectra"]):
        return
    links = sorted(name for name, place in config["network"]["stations"].items() if "transmit" in place)
    kind = config["shards"]["kind"]
    given = {"effects": sorted(config["effects"]), "links": links, "shards.kind": "" if kind == "image" else kind}
    for key, value in given.items():
        if value:
            raise InputError(
                f"spectra: {list(named(config['spectra']))} and {key} is {value!r}, expected no {key}: range profiles "
                "are made of clean targets, by stations that hear themselves, where tiles are"
            )


def refuse_signals(config: dict, scheme: Scheme) -> None:
    """Refuse a scheme on signals or features where their caches are not made, or of another number of symbols."""
    block, symbols = config["recognition"], config["network"]["symbols"]
    if not block["cache"]:
        raise InputError(f"recognition: scheme {scheme.name!r} sees {scheme.sees}, expected cache: true")
    if scheme.sees == "signals" and scheme.size != symbols:
        raise InputError(f"scheme {scheme.name!r}: size {scheme.size}, expected the {symbols} symbols of a signal")


def refuse_height(config: dict, scheme: Scheme) -> None:
    """Refuse a scheme with measured heights where no track is made or where fresh samples without one join in."""
    if not scheme.cues:
        return
    block = config["recognition"]
    links = sorted(name for name, place in config["network"]["stations"].items() if "transmit" in place)
    given = {
        "effects": sorted(config["effects"]), "links": links, "input": block.get("input") == "dataset",
        "timed": scheme.name in block["timed"], "training.stream": block["training"].get("stream"),
    }  # fmt: skip
    for key, value in given.items():
        if value:
            raise InputError(
                f"recognition: scheme {scheme.name!r} has the cue {scheme.cues!r} and {key} is {value!r}, expected "
                f"no {key}: heights are measured of stored samples, by stations that hear themselves"
            )


def refuse_starts(starts: dict[str, dict], trained: set[str]) -> None:
    """Refuse a start that this run does not train, that has met samples which are tested, or that goes in a circle.

    starts: of each training, {"from": ...}; trained: all trainings of the run, as PROTOCOL/SCHEME.
    """
    for name, entry in starts.items():
        origin = entry["from"]
        if origin not in trained:
            raise InputError(f"recognition.start: {name} from {origin!r}, expected one of {sorted(trained)}")
        own, theirs = name.split("/")[0], origin.split("/")[0]
        parts = ("train", "validation")
        if not all(folds(theirs, part) <= folds(own, part) for part in parts):
            raise InputError(
                f"recognition.start: {name} from {origin!r}, which trains on samples that {own!r} tests; expected a "
                "training in a protocol whose samples are all among its own"
            )
        passed = [name]
        while passed[-1] in starts:
            passed.append(starts[passed[-1]]["from"])
            if passed[-1] in passed[:-1]:
                raise InputError(f"recognition.start: {' from '.join(passed)} is a circle")


def refuse_extra(config: dict, name: str, classes: tuple[str, ...]) -> None:
    """Refuse to train on a run that is missing, differs in network, spectra, images or classes, or has this seed."""
    made = Path("results") / name / "config.yaml"
    if name in (config["run"], config.get("data")) or not made.is_file():
        raise InputError(f"recognition.extra: {name!r}, expected another, finished run; no {made} or it is this run")
    if not config["recognition"]["cache"]:
        raise InputError("recognition.extra: given without recognition.cache, expected true")
    own, other = plain(as_named(config)), plain(as_named(load_yaml(made)))
    differ = [key for key in ("network", "spectra", "images") if own[key] != other[key]]
    if differ:
        raise InputError(f"recognition.extra: run {name!r} has other settings of {differ}, expected equal ones")
    others = classes_of({name: record["published"] for name, record in records_of(located(other)["targets"]).items()})
    if others != classes:
        raise InputError(f"recognition.extra: run {name!r} has the classes {others}, expected {classes}")
    if own["seed"] == other["seed"]:
        raise InputError(
            f"recognition.extra: run {name!r} has this run's seed {own['seed']}, so its motion models would be those "
            "that are tested; expected another seed"
        )


def refuse_no_files(targets: dict, inputs: str | None) -> None:
    """Refuse a folder of inputs that holds none of the named files, where built-in models would replace them all."""
    if targets.get("where_missing") != "builtin":
        return
    named = records_of({**targets, "where_missing": "refuse"})
    real = {name: record for name, record in named.items() if record["source"] in ("mesh", "mocap")}
    lacking = [name for name, record in real.items() if missing_inputs({name: record}, inputs)]
    if real and len(lacking) == len(real):
        raise InputError(f"inputs: {inputs}, expected a folder with the files of at least one of {lacking}")


def refuse_heights(heights: dict, published: dict, classes: tuple[str, ...]) -> None:
    """Refuse flight heights for names that are neither subtypes nor classes, and a range that is reversed."""
    unknown = sorted(set(heights) - {*published, *classes, *CATEGORIES})
    if unknown:
        raise InputError(f"motion.height_m: {unknown}, expected subtypes, classes {list(classes)} or {list(AIRBORNE)}")
    for name, (low, high) in heights.items():
        if low > high:
            raise InputError(f"motion.height_m: {name} from {low} to {high} m, expected the lower height first")


def refuse_data(config: dict) -> None:
    """Refuse another run's data set that is not there or was made with other settings than this configuration's."""
    name = config.get("data", config["run"])
    if name == config["run"]:
        return
    made = Path("results") / name / "config.yaml"
    if not made.is_file():
        raise InputError(f"data: no {made}, expected a finished run; make run {name!r} first")
    own, other = plain(as_named(config)), plain(as_named(load_yaml(made)))
    differ = [key for key in sorted({*own, *other} - set(TRAINING_BLOCKS)) if own.get(key) != other.get(key)]
    if differ:
        raise InputError(f"data: run {name!r} was made with other settings of {differ}, expected equal ones")


def refuse_missing(config: dict) -> None:
    """Refuse a file or folder that the configuration names and that is not there: jobs ask for some of them last."""
    report, network = config["report"], config["recognition"]["network"]
    backbone, colon, _ = network["backbone"].rpartition(":")
    files = {
        "inputs": [config["inputs"]],
        "recognition.table": [config["recognition"]["table"]],
        "recognition.network.backbone": [backbone] if colon and backbone.endswith(".py") else [],
        "recognition.network.weights": [] if network["weights"] in ("none", "hub") else [network["weights"]],
        "report.effect_scenes": report["effect_scenes"],
        **{f"report.{key}": [report[key]] for key in ("published", "accuracy", "measured")},
    }
    for key, paths in files.items():
        missing = [path for path in paths if path is not None and not Path(path).exists()]
        if missing:
            raise InputError(f"{key}: {missing[0]!r} is not there, expected the path of a file or folder that is")
