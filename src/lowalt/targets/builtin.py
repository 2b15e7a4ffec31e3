"""Built-in models: the check of a record's figures with their units and sources.

The module also makes a record's cloud.
"""

import hashlib
import json

from lowalt.config.classes import like
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.targets import bird, record_schema, uav, vehicle
from lowalt.targets.assemble import allot, assemble
from lowalt.targets.cloud import Cloud

MODULES = {"UAV": uav, "Bird": bird, "Vehicle": vehicle}
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "1": 1.0}
"""Units a figure may have; "1" is a ratio or a count."""


def _figure(figure: list, kind: str, sources: dict, where: str) -> dict:
    """Return the figure [value, unit, source] as a record that also has the value in SI units."""
    value, unit, source = figure
    unit = str(unit)
    units = [name for name in UNITS if (name != "1") == (kind == "length")]
    if unit not in units:
        raise InputError(f"{where}: unit is {unit!r}, expected one of {units}")
    least = 0 if kind in ("whole", "offset") else 1e-9
    if not least <= value < 1e5 or (kind in ("count", "whole") and not float(value).is_integer()):
        raise InputError(
            f"{where}: value is {value!r}, expected a positive number fit for a {kind}"
        )
    if source != "estimate" and source not in sources:
        raise InputError(
            f"{where}: source is {source!r}, expected 'estimate' or one of {sorted(sources)}"
        )
    return {"value": value, "unit": unit, "source": source, "si": value * UNITS[unit]}


def check_record(merged: dict, where: str) -> dict:
    """Return the merged record with its figures resolved to SI units, checked.

    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    category = like(merged)
    name = merged["model"]
    every = record_schema.schema()["models"]
    models = {known: model for known, model in every.items() if model["like"] == category}
    if not models:
        raise InputError(
            f"{where}: source is 'builtin', which has no {category} model; expected gait or mocap"
        )
    if name not in models:
        raise InputError(f"{where}: model is {name!r}, expected one of {sorted(models)}")
    model = models[name]
    rotors = merged["published"]["n_rotors_or_wings"]
    own_keys = model.get("keys", [])
    if others := sorted({"coaxial", "flap", "wheel_size"} & set(merged) - set(own_keys)):
        raise InputError(f"{where}: {others} are not for model {name}, expected {own_keys} at most")
    size_is = merged["size_is"]
    possible = model["size_is"]
    if size_is not in possible:
        raise InputError(
            f"{where}: size_is is {size_is!r}, expected one of {possible} with model {name}"
        )
    if rotors not in model.get("rotors", [rotors]):
        number = " or ".join(map(str, model["rotors"]))
        raise InputError(
            f"{where}: model is {name}, expected n_rotors_or_wings {number} in its row, not "
            f"{rotors}"
        )
    kinds = record_schema.figures(name)
    figures = merged.get("figures", {})
    if size_is == "body diagonal":
        kinds = kinds | {"motor_diagonal": "length"}
    if wrong := sorted(set(kinds) ^ set(figures)):
        raise InputError(
            f"{where}: figures {wrong} missing or unknown, expected exactly {sorted(kinds)}"
        )
    sources = merged.get("sources", {})
    share = merged.get("moving_share", MODULES[category].MOVING_SHARE)
    resolved = {
        name: _figure(figure, kinds[name], sources, f"{where}: figures.{name}")
        for name, figure in figures.items()
    }
    result = merged | {"figures": resolved, "moving_share": share}
    if fault := MODULES[category].fault(result):
        raise InputError(f"{where}: {fault}")
    allot(MODULES[category].parts(result)[0], result["points"], share, where)
    return result


def checksum(record: dict) -> str:
    """Return the SHA-256, 64 hexadecimal digits, of a record as JSON of sorted keys, no spaces."""
    text = json.dumps(record, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def builtin_cloud(record: dict, seed: int) -> Cloud:
    """Return the cloud of a merged record whose source is `builtin`.

    Equal record and seed give equal points.
    Raises: InputError where the record asks for fewer points than its parts need.
    """
    parts, facts = MODULES[like(record)].parts(record)
    full = record | facts | {"checksum": checksum(record), "seed": seed}
    return assemble(parts, full, stream(seed, "cloud", record["subtype"]))
