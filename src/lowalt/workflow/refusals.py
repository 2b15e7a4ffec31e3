"""Checks that refuse a configuration that contradicts itself, another run, or existing files.

Each function raises InputError naming the key, its value and what was expected. `Run.of` calls them
before any job.
"""

import contextlib
import itertools
from collections.abc import Collection
from pathlib import Path

from lowalt.config.brought import OF_TRAINING, refuse_brought
from lowalt.config.classes import AIRBORNE, CATEGORIES
from lowalt.config.layers import plain
from lowalt.config.named_code import file_and_function, file_of, own_effects
from lowalt.config.network import SPEED_OF_LIGHT, masts_m, station_names
from lowalt.files.atomic import slug
from lowalt.files.errors import InputError
from lowalt.files.shipped import SHIPPED, as_named
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition.schemes import Scheme, columns_in, names
from lowalt.recognition.schemes import named as scheme_named
from lowalt.scene.checks import check, refuse_unknown_subtypes
from lowalt.scene.effects import named_files
from lowalt.scene.set_noise import in_all_cells
from lowalt.shards.clean import refuse
from lowalt.spectra.catalogue import named, of_cells
from lowalt.targets.records import missing_inputs, records_of

TRAINING_BLOCKS = ("run", "data", "inputs", "cost", "recognition", "report")
"""Blocks of the configuration that may differ between a run and the run whose data set it trains
on.
"""


def refuse_braces(config: dict, inputs: str | None) -> None:
    """Refuse paths with braces, which Snakemake would interpret as wildcards or format fields."""
    keys = (
        ("recognition", "table"),
        ("report", "published"),
        ("report", "accuracy"),
        ("motion", "track"),
    )
    paths = {
        "inputs": inputs,
        "the folder of lowalt": str(SHIPPED),
        "effects": " ".join(own_effects(config["effects"])),
        **named_files(config["effects"]),
    }
    for block, key in keys:
        paths[f"{block}.{key}"] = config.get(block, {}).get(key)
    for name, path in paths.items():
        if path and ("{" in path or "}" in path):
            raise InputError(f"{name}: {path!r}, expected a path without braces")


def refuse_scene(config: dict, subtypes: Collection[str]) -> None:
    """Refuse effects that do not fit one another, the run's subtypes or added SNRs.

    The noise of added SNRs must not be part of the echoes.
    """
    check(config, shows_all_cells(config))
    refuse_unknown_subtypes(config["effects"], subtypes)
    adds_snrs = any("snr_db" in step for step in config.get("added", []))
    noisy = in_all_cells(config["effects"])
    if adds_snrs and noisy:
        raise InputError(
            f"added: snr_db together with effects.{noisy[0]}, whose echoes contain the noise of "
            "all SNRs"
        )


def refuse_contradictions(config: dict, published: dict, classes: tuple[str, ...]) -> None:
    """Refuse values that contradict each other, and missing files.

    published: rows of the table of targets by subtype; classes: those of the table.
    """
    if config["run"] in config["recognition"]["transfer"]:
        raise InputError(
            f"recognition.transfer: {config['run']!r} is this run, expected other runs"
        )
    refuse_heights(config["motion"]["height_m"], published, classes)
    refuse_sizes(config, classes)
    for refuse_values in (refuse_cells, refuse_missing, refuse_region, refuse_speeds, refuse_input):
        refuse_values(config)


def _refuse_names(key: str, ranges: dict, names: Collection[str], expected: str) -> None:
    """Refuse ranges of unknown names."""
    unknown = sorted(set(ranges) - set(names))
    if unknown:
        raise InputError(f"{key}: {unknown}, expected {expected}")


def refuse_sizes(config: dict, classes: tuple[str, ...]) -> None:
    """Refuse sizes of unknown classes, and sizes together with effects."""
    sizes = config["motion"].get("sizes_m", {})
    _refuse_names("motion.sizes_m", sizes, classes, f"some of the classes {list(classes)}")
    if sizes and config["effects"]:
        raise InputError(
            f"motion.sizes_m: given together with effects {sorted(config['effects'])}, expected "
            "one or the other"
        )


SIMULATED_ON_ACCESS = "dataset"
"""Value of `recognition.input` with which trainings read no shards but simulate their samples."""


def refuse_input(config: dict) -> None:
    """Refuse a cache of images simulated on access, and recipe shards without clean echoes."""
    if config["shards"]["kind"] == "recipe":
        refuse(config["effects"])
    block = config["recognition"]
    if block.get("input") != SIMULATED_ON_ACCESS:
        return
    own = own_effects(config["effects"])
    if own:
        raise InputError(
            f"recognition.input: 'dataset' together with the effects {own}, expected shards"
        )
    # The jobs read the run's own config.yaml, which may be a stranger's for all they know.
    unused = ("inputs", *OF_TRAINING)
    used = {key: value for key, value in config.items() if key not in unused}
    refuse_brought(used, "recognition.input: 'dataset'")
    if block["cache"]:
        raise InputError(
            "recognition.input: 'dataset' together with recognition.cache true, expected cache: "
            "false"
        )


def shows_all_cells(config: dict) -> bool:
    """Return whether the data set stores or shows range cells of all symbols."""
    return config["shards"]["kind"] == "cube" or bool(of_cells(config["spectra"]))


def refuse_cells(config: dict) -> None:
    """Refuse spectra of range cells with shards of signals, and `shards.cells` without cubes."""
    kind = config["shards"]["kind"]
    shown = of_cells(config["spectra"])
    cells = config["shards"].get("cells")
    if cells and kind != "cube":
        raise InputError(f"shards.cells: {cells!r} and shards.kind {kind!r}, expected kind 'cube'")
    if shown and kind not in ("image", "cube"):
        raise InputError(
            f"spectra: {shown} and shards.kind {kind!r}, expected 'image' or 'cube': signals hold "
            "one cell"
        )


def refuse_no_files(targets: dict, inputs: str | None) -> None:
    """Refuse a folder with no named file if built-in models would silently replace them all."""
    if targets.get("where_missing") != "builtin":
        return
    records = records_of({**targets, "where_missing": "refuse"})
    real = {
        name: record for name, record in records.items() if record["source"] in ("mesh", "mocap")
    }
    lacking = [name for name, record in real.items() if missing_inputs({name: record}, inputs)]
    if real and len(lacking) == len(real):
        raise InputError(
            f"inputs: {inputs}, expected a folder with the files of at least one of {lacking}"
        )


def refuse_heights(heights: dict, published: dict, classes: tuple[str, ...]) -> None:
    """Refuse flight heights of names that are no subtypes or classes, and reversed ranges."""
    known = {*published, *classes, *CATEGORIES}
    expected = f"subtypes, classes {list(classes)} or {list(AIRBORNE)}"
    _refuse_names("motion.height_m", heights, known, expected)


def refuse_data(config: dict) -> None:
    """Refuse another run's data set if it or its images are missing or its settings differ."""
    name = config.get("data", config["run"])
    if name == config["run"]:
        return
    made = Path("results") / name / "config.yaml"
    if not made.is_file():
        raise InputError(f"data: no {made}, expected a finished run; make run {name!r} first")
    here = plain(as_named(config))
    other = plain(as_named(load_yaml(made)))
    of_data = sorted({*here, *other} - set(TRAINING_BLOCKS))
    differ = [key for key in of_data if here.get(key) != other.get(key)]
    if differ:
        raise InputError(
            f"data: run {name!r} was made with other settings of {differ}, expected equal ones"
        )
    needed = ["SHA256SUMS"]
    if config["recognition"]["cache"]:
        needed.append("views")
    lacking = [entry for entry in needed if not (made.parent / entry).exists()]
    if lacking:
        raise InputError(
            f"data: {made.parent} has no {' and no '.join(lacking)}, expected a run made to its "
            f"end; make run {name!r} without --target first"
        )


def refuse_missing(config: dict) -> None:
    """Refuse a missing file or folder that the configuration names.

    Some are needed only by the last jobs.
    """
    network = config["recognition"]["network"]
    files = {
        "inputs": config["inputs"],
        "motion.track": config["motion"].get("track"),
        **named_files(config["effects"]),
        "recognition.table": config["recognition"]["table"],
    }
    if file_of(network["backbone"]) is not None:
        files["recognition.network.backbone"] = file_and_function(network["backbone"])[0]
    if network["weights"] not in ("none", "hub"):
        files["recognition.network.weights"] = network["weights"]
    for key in ("published", "accuracy"):
        files[f"report.{key}"] = config["report"][key]
    for key, path in files.items():
        if path is not None and not Path(path).exists():
            raise InputError(
                f"{key}: {path!r} is not there, expected the path of a file or folder that is"
            )


def refuse_region(config: dict) -> None:
    """Refuse a region with zero area, given explicitly or spanned by the stations."""
    polygon = config["motion"]["region"]["polygon_m"]
    corners = polygon
    if corners is None:
        corners = masts_m(config["network"])
    sides = [(x - corners[0][0], y - corners[0][1]) for x, y in corners[1:]]
    parallel = all(a * d == b * c for (a, b), (c, d) in itertools.product(sides, repeat=2))
    if not parallel:
        return
    stations = ""
    if polygon is None:
        stations = f", the area between the stations, and there is none between {corners}"
    raise InputError(
        f"motion.region.polygon_m: {polygon}{stations}; expected corners (m) such as "
        "[[0, 0], [500, 0], [250, 433]]"
    )


def refuse_speeds(config: dict) -> None:
    """Refuse VT speeds beyond the unambiguous speed c / (4 f T_r), where the spectrum repeats."""
    network = config["network"]
    vt = config["spectra"].get("vt")
    fold = SPEED_OF_LIGHT / (4 * network["carrier_hz"] * network["symbol_interval_s"])
    # Unevenly spaced symbols resolve higher speeds if their instants are known.
    if vt is None or config["spectra"].get("times") == "known":
        return
    low = vt["speed_min_mps"]
    high = vt["speed_max_mps"]
    if high - low > 2 * fold + vt["speed_step_mps"]:
        raise InputError(
            f"spectra.vt: speed_min_mps {low:g} to speed_max_mps {high:g}, expected at most "
            f"{-fold:.3g} to {fold:.3g}: speeds fold there with network.carrier_hz "
            f"{network['carrier_hz']:g} and symbol_interval_s {network['symbol_interval_s']:g}"
        )


def _suited(config: dict, name: str) -> Scheme:
    """Return a scheme of the table.

    Raises: InputError where this configuration lacks its stations or spectra.
    """
    table = config["recognition"]["table"]
    stations = station_names(config["network"])
    scheme = scheme_named(table, name, stations)
    columns_in(scheme.columns, named(config["spectra"]), len(stations), table)
    return scheme


def _able(config: dict) -> list[str]:
    """Names of the table's schemes that suit the stations and spectra of this configuration."""
    suited = []
    for name in names(config["recognition"]["table"]):
        with contextlib.suppress(InputError):
            suited.append(_suited(config, name).name)
    return suited


def schemes_of(config: dict) -> dict[str, Scheme]:
    """Return the schemes that a run trains or times, by the name that the configuration gives them.

    Raises: InputError for a scheme that does not suit the stations and spectra, listing those that
    do; for one named twice; and if no scheme trains in a protocol of the run.
    """
    block = config["recognition"]
    known = {slug(name) for name in names(block["table"])}
    schemes = {}
    for key in ("schemes", "timed"):
        for name in block[key]:
            try:
                schemes[name] = _suited(config, name)
            except InputError as error:
                advice = ""
                if slug(name) in known:
                    able = _able(config) or "none: name a table of your own in recognition.table"
                    advice = f"; for this network and its spectra {block['table']} has {able}"
                raise InputError(f"recognition.{key}: {name!r}: {error}{advice}") from None
    trained = [schemes[name] for name in block["schemes"]]
    if len({scheme.name for scheme in trained}) < len(trained):
        raise InputError(f"recognition.schemes: {block['schemes']}, expected every scheme once")
    offered = set(itertools.chain.from_iterable(scheme.protocols for scheme in trained))
    if not offered & set(block["protocols"]):
        raise InputError(
            f"recognition.protocols: {block['protocols']}, expected a protocol of one of "
            f"{block['schemes']}, which {block['table']} gives {sorted(offered)}"
        )
    return schemes
