# What the rules share: the checked configuration, the plan that follows from it, and the settings of each stage.
# This is the only file of the workflow with functions.
import functools
import os
from pathlib import Path

from snakemake.exceptions import WorkflowError

from lowalt.common.config import canonical, check
from lowalt.common.environment import prepare
from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.common.files import slug
from lowalt.common.plan import Plan
from lowalt.recognition.schemes import named
from lowalt.workflow import locks, space_check
from lowalt.workflow.sources import sources
from lowalt.spectra import Spectra
from lowalt.targets.records import load_records, missing_inputs, source_files
from lowalt.tiles.settings import Images

SCHEMA = Path(workflow.basedir) / "workflow" / "schemas" / "config.schema.yaml"


def prepared(config):
    """The checked configuration's records and plan; every fault is named before any job starts."""
    try:
        check(config, SCHEMA)
        records = load_records(config["targets"]["table"], config["targets"]["records"])
        published = {name: record["published"] for name, record in records.items()}
        plan = Plan.of(config, published)
        chosen = {name: records[name] for members in plan.groups.values() for name in members}
        Spectra.from_settings(config["spectra"]).check(Network.from_settings(config["network"]).symbols)
        Images.from_settings(config["images"])
        block = config["recognition"]
        schemes = {name: named(block["table"], name) for name in (*block["schemes"], *block["timed"])}
        if RUN in block["transfer"]:
            raise InputError(f"recognition.transfer: {RUN!r} is this run, expected other runs")
        if config["effects"]:
            from lowalt.effects.checks import check as check_effects

            check_effects(config)
        lacking = missing_inputs(chosen, INPUTS)
        if lacking:
            raise InputError("missing inputs:\n  " + "\n  ".join(lacking))
    except InputError as error:
        raise WorkflowError(str(error)) from None
    return chosen, plan, schemes


locks.install()
INPUTS = prepare(Path(workflow.basedir) / "src", config["inputs"])
RUN = config["run"]
RECORDS, PLAN, SCHEMES = prepared(config)
STATIONS = list(config["network"]["stations"])
# An echo job's stations: the wildcard's, or all.
HEARD, OF_STATION = (["{station}"], "-{station}") if config["echo"]["job"] == "station" else (STATIONS, "")
BY_SLUG = {slug(name): name for name in RECORDS}
SLUGS = list(BY_SLUG)
BY_SCHEME = {scheme.slug: scheme for scheme in SCHEMES.values()}
TRAINED = [SCHEMES[name] for name in config["recognition"]["schemes"]]
TIMED = [SCHEMES[name] for name in config["recognition"]["timed"]]
OTHERS = config["recognition"]["transfer"]


wildcard_constraints:
    run=RUN,
    subtype="|".join(SLUGS),
    group="|".join(PLAN.groups),
    part=r"\d{5}",
    station="|".join(STATIONS),
    fold="train|val|test",
    protocol="seen|unseen",
    scheme="|".join(BY_SCHEME),
    # Without other runs nothing matches.
    other="|".join(OTHERS) or "(?!)",
    size=r"\d+",
    call=r"[a-z0-9_-]+",
    train_seed=r"\d+",


TRAININGS = [
    f"{protocol}/{scheme.slug}/{seed}"
    for scheme in TRAINED
    for protocol in config["recognition"]["protocols"]
    if protocol in scheme.protocols
    for seed in config["recognition"]["seeds"]
]
PRICED = [f"unseen/{scheme.slug}/{config['recognition']['seeds'][0]}" for scheme in TRAINED]
SOURCE_MODULES = [f"lowalt.targets.{name}" for name in ("builtin", "gait", "mesh", "mocap")]
TABLE_NAMES = "accuracy confusion subtypes comparisons orderings alarms calibration reliability"
RESULT_TABLES = [f"{name}.csv" for name in TABLE_NAMES.split()]


def code(*modules):
    """The source files a command runs, as inputs: editing one re-runs its jobs. The command, then its own imports."""
    return [os.path.relpath(path, workflow.basedir) for path in sources(*modules)]


def group_clouds(wildcards):
    """Cloud files of a group's subtypes, in the table's order."""
    return [f"results/{wildcards.run}/clouds/{slug(name)}.npz" for name in PLAN.groups[wildcards.group]]


def effect_modules():
    """The modules of the effects that this scene names, and of no other."""
    from lowalt.effects.catalogue import dotted

    return [dotted(name) for name in config["effects"]]


def group_occluders(wildcards):
    """Surface files of a group's subtypes where the scene hides points behind surfaces, none elsewhere."""
    if "occlusion" not in config["effects"]:
        return []
    return [f"results/{wildcards.run}/occluders/{slug(name)}.npz" for name in PLAN.groups[wildcards.group]]


def occluders_option(wildcards, input):
    return f"--occluders {input.occluders}" if input.occluders else ""


@functools.cache
def effect_calls():
    """What is priced: no effects, each alone with its defaults, scenes; {effects, tolerance, snr_db} by name."""
    from lowalt.measure.effects_calls import calls

    try:
        return calls(config, SCHEMA)
    except InputError as error:
        raise WorkflowError(str(error)) from None


def effect_call(wildcards):
    found = effect_calls()
    if wildcards.call not in found:
        raise WorkflowError(f"results/{RUN}/effects: no call {wildcards.call!r}, expected one of {list(found)}")
    return found[wildcards.call]


def call_code(wildcards):
    from lowalt.effects.catalogue import dotted

    return code("lowalt.measure.effects_samples", *map(dotted, effect_call(wildcards)["effects"]))


def call_occluders(wildcards):
    """Surface files of a group's subtypes where the call hides points behind surfaces, none elsewhere."""
    needed = PLAN.groups[wildcards.group] if "occlusion" in effect_call(wildcards)["effects"] else []
    return [f"results/{wildcards.run}/occluders/{slug(name)}.npz" for name in needed]


def call_settings(wildcards):
    kept = ("network", "spectra", "images", "split", "seed")
    more = {"name": wildcards.call, "models": config["report"]["effect_models"], "size": pixels(asked_scheme())}
    return canonical({key: config[key] for key in kept} | effect_call(wildcards) | more)


def call_files(wildcards):
    """A file a group and call, scenes first: they take longest."""
    names = reversed(effect_calls())
    return [f"results/{wildcards.run}/effects/{group}-{name}.npz" for name in names for group in PLAN.groups]


def asked_scheme():
    """The scheme whose network is asked what effects do: that of the most images, trained on all subtypes."""
    able = [scheme for scheme in TRAINED if "seen" in scheme.protocols and "seen" in config["recognition"]["protocols"]]
    if not able:
        raise WorkflowError("effects: no scheme is trained in the protocol 'seen', expected one in recognition.schemes")
    return max(able, key=lambda scheme: len(scheme.columns))


def asked_model(wildcards):
    return f"results/{wildcards.run}/models/seen/{asked_scheme().slug}/{config['recognition']['seeds'][0]}/model.pt"


def effect_products(wildcards):
    """Table and figure of priced effects where the report shows them."""
    return multiext(f"results/{wildcards.run}/effects", ".csv", ".png") if config["report"]["effects"] else []


def effect_products_option(wildcards, input):
    return "--effects {} {}".format(*input.effects) if input.effects else ""


def record_files(wildcards):
    """The user's mesh or recording files that one subtype's record names."""
    return source_files(RECORDS[BY_SLUG[wildcards.subtype]], INPUTS)


def cloud_settings(wildcards):
    return canonical({"seed": config["seed"], "record": RECORDS[BY_SLUG[wildcards.subtype]]})


def motion_settings(wildcards):
    kept = ("region", "height_m", "tilt_deg", "cadence")
    return canonical(
        {
            "seed": config["seed"],
            "masts_m": [place["position_m"][:2] for place in config["network"]["stations"].values()],
            "motion": {key: config["motion"][key] for key in kept},
            "published": {name: RECORDS[name]["published"] for name in PLAN.groups[wildcards.group]},
        }
    )


def motion_span(wildcards):
    return "--first {} --count {}".format(*PLAN.span(f"{wildcards.group}-{wildcards.part}"))


def cost_clouds(wildcards):
    """Cloud files of the first subtype of each category, in the table's order."""
    first = {}
    for name, record in RECORDS.items():
        first.setdefault(record["published"]["category"], name)
    return [f"results/{wildcards.run}/clouds/{slug(name)}.npz" for name in first.values()]


def cost_settings(*kept):
    """The configuration's blocks `kept`, the seed, and how accuracy is priced."""
    return canonical({key: config[key] for key in (*kept, "seed", "cost")})


def cost_products(wildcards):
    """Tables and figure of what accuracy costs, where the report shows them."""
    return multiext(f"results/{wildcards.run}/cost", ".csv", "_pixels.csv", ".png") if config["report"]["cost"] else []


def cost_products_option(wildcards, input):
    return "--cost {} {} {}".format(*input.cost) if input.cost else ""


def heard_stations(wildcards):
    """The stations whose echoes a job makes."""
    return [wildcards.station] if OF_STATION else STATIONS


def chunk_echoes(wildcards):
    """The stations' clean echoes of a chunk, in the order of the stations."""
    stem = f"results/{wildcards.run}/echo/{wildcards.group}-{wildcards.part}"
    return [f"{stem}/{station}.npy" for station in STATIONS]


def chunk_powers(wildcards):
    """What set SNRs refer to in a scene with effects: the powers of the targets' own echoes, a file a station."""
    stem = f"results/{wildcards.run}/echo/{wildcards.group}-{wildcards.part}"
    return [f"{stem}/{station}.power.npy" for station in STATIONS] if config["effects"] else []


def powers_option(wildcards, input):
    return f"--powers {input.powers}" if input.powers else ""


def shard_tiles(wildcards):
    """A chunk's tiles, where shards hold images; signal shards need none, so none are rendered."""
    if config["shards"]["kind"] == "signal":
        return {}
    return {"tiles": f"results/{wildcards.run}/tiles/{wildcards.group}-{wildcards.part}.npz"}


def shard_settings(wildcards):
    return canonical(
        {
            "seed": config["seed"],
            "network": config["network"],
            "snr_db": config["noise"]["snr_db"],
            "split": config["split"],
            "shards": config["shards"],
        }
    )


def pixels(scheme):
    """Pixels a side that a scheme's network sees."""
    return scheme.size or config["recognition"]["size"]


def sample_source(wildcards):
    """What training and evaluation read: the shared caches of images shrunk to the scheme's size, or the shards."""
    base = f"results/{wildcards.run}"
    if config["recognition"]["cache"]:
        size = pixels(BY_SCHEME[wildcards.scheme])
        return {"views": [f"{base}/views/{size}/{shard}.npz" for shard in PLAN.shards]}
    return {"index": f"{base}/shards/index.json"}


def source_option(wildcards, input):
    return f"--views {input.views}" if "views" in input.keys() else f"--index {input.index}"


def training_settings(wildcards):
    """How a network is trained: by its own seed, or by the run's where no training is named."""
    block = config["recognition"]
    kept = {key: block[key] for key in ("size", "network", "training", "augmentation")}
    seed = int(wildcards.get("train_seed", config["seed"]))
    return canonical({"seed": seed, "colour_map": config["images"]["colour_map"], **kept})


def benchmark_files(wildcards):
    """Benchmarks of all jobs, in pipeline order."""
    base = f"results/{wildcards.run}/benchmarks"
    tiles = [f"tiles/{chunk}" for chunk in PLAN.chunks] if config["shards"]["kind"] == "image" else []
    sizes = sorted({pixels(scheme) for scheme in TRAINED}) if config["recognition"]["cache"] else []
    views = [f"views/{size}/{shard}" for size in sizes for shard in PLAN.shards]
    names = [
        *(f"cloud/{subtype}" for subtype in SLUGS),
        *(f"motion/{chunk}" for chunk in PLAN.chunks),
        *expand(f"echo/{{chunk}}{OF_STATION}", chunk=PLAN.chunks, station=STATIONS),
        *(f"noise/{chunk}" for chunk in PLAN.chunks),
        *tiles,
        *(f"shard/{shard}" for shard in PLAN.shards),
        "index",
        *views,
        *(f"train/{training}" for training in TRAININGS),
        *(f"evaluate/{training}" for training in TRAININGS),
        "distances",
        "tables",
    ]
    return [f"{base}/{name}.jsonl" for name in names]


def recognition_options(wildcards, input):
    """The report's options for what recognition left beside its accuracy."""
    base = f"results/{wildcards.run}"
    names = ("orderings", "alarms", "calibration", "reliability", "distances")
    options = [f"--{name} {base}/{name}.csv" for name in names]
    options += [f"--transfer {input.transfer}"] if input.transfer else []
    return " ".join(options + ([f"--accuracy-cost {input.accuracy}"] if input.accuracy else []))


def report_settings(wildcards):
    return canonical({"config": config, "published": {name: record["published"] for name, record in RECORDS.items()}})
