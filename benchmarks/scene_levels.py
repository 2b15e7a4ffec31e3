"""Levels of one sample in every shipped scene, as a link budget lists them, and the mean level of
every target.

    python benchmarks/scene_levels.py --out results/benchmarks/scene_levels.csv
    python benchmarks/scene_levels.py --targets results/benchmarks/target_levels.csv

The sample is the first motion model of the DJI Mavic 3 Pro at the first station, or on the first
link; the same lines as `lowalt explain SCENE --sample "DJI Mavic 3 Pro:0" --no-table` prints.
A target's level is the mean over looks, drawn as the default scene draws them, of the echo over the
radar equation's for 1 m2 at the target's place at each symbol. Columns in dBsm: what is stated;
points whose cross sections add to that; points as `mean_cross_section` gives them, by one frequency
and one element, with its standard error. Columns in dB: what the strongest cell of 256 subcarriers
and 16 x 4 elements that point at the start of the look add to that.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from lowalt.config.layers import load
from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.files.csv_tables import write_csv
from lowalt.motion.drawing import draw, region_polygon
from lowalt.numerics.streams import stream
from lowalt.scene.chain import SceneSample, received_signal
from lowalt.scene.effects import called
from lowalt.scene.effects.channel import mean_cross_section
from lowalt.scene.explanation import samples
from lowalt.scene.levels import Level, levels
from lowalt.scene.observe import Scene, observe, with_cross_sections
from lowalt.targets.make import make
from lowalt.targets.records import load_records

COLUMNS = ("scene", "station", "level", "value", "unit")
TARGET_COLUMNS = (
    "subtype",
    "stated_dbsm",
    "added_dbsm",
    "simulated_dbsm",
    "simulated_less_stated_db",
    "standard_error_db",
    "range_cells_db",
    "beams_db",
)
SAMPLE = "DJI Mavic 3 Pro", 0
OWN = "cross_sections", "element", "visible", "beams", "sampling"
"""Functions of the effects that act on the target's own echo on the direct path."""


def scene_levels(root: Path, name: str) -> tuple[str, list[Level]]:
    """Return the station and the levels of the sample in a shipped scene; root: the repository's
    folder.
    """
    paths = [root / "config/default.yaml", root / f"config/scenes/{name}.yaml"]
    config = load(paths, root / "workflow/schemas/config.schema.yaml")
    config["targets"]["table"] = str(root / config["targets"]["table"])
    config["targets"]["records"] = [str(root / path) for path in config["targets"]["records"]]
    network = Network.from_settings(config["network"])
    every = called(config["effects"])
    alone = tuple(
        effect
        for effect in every
        if effect.place == "motion" or any(hasattr(effect.module, name) for name in OWN)
    )
    sample = samples(config, None, [SAMPLE])[0]
    links = [station for station in network.stations if station.transmitter is not None]
    station = (links or network.stations)[0]
    scene = Scene(network, config["seed"], None, alone)
    view = observe(scene, station, *sample)
    return station.name, levels(view, every, SceneSample(scene, view).power)


def target_records(root: Path) -> tuple[dict, dict]:
    """Return the default configuration and the records of its targets by subtype; root: the
    repository's folder.
    """
    config = load([root / "config/default.yaml"], root / "workflow/schemas/config.schema.yaml")
    settings = config["targets"]
    return config, load_records(
        root / settings["table"], [root / path for path in settings["records"]]
    )


def target_level(config: dict, record: dict, looks: int) -> list[float]:
    """Return the columns of `TARGET_COLUMNS` behind the subtype, from looks of a second at 8
    instants each.
    """
    whole = replace(Network.from_settings(config["network"]), symbols=8, symbol_interval_s=0.12)
    cells = replace(whole, transmit=(1, 1), receive=(1, 1))
    cloud = make(record, None, config["seed"])
    masts = np.array([one.position_m[:2] for one in whole.stations])
    corners = region_polygon(masts, None)
    effects = tuple(called({"mean_cross_section": {}}))
    wave = SPEED_OF_LIGHT / whole.carrier_hz
    networks = replace(cells, subcarriers=1), cells, whole
    found = np.empty((len(networks), looks))
    for look in range(looks):
        rng = stream(config["seed"], "target level", cloud.subtype, look)
        row = draw(rng, cloud, record["published"], masts, corners, config["motion"]) | {
            "model": look
        }
        place = np.array([row[f"{axis}_m"] for axis in "xyz"])
        path = place + np.outer(whole.times_s, [row[f"v{axis}_mps"] for axis in "xyz"])
        for which, network in enumerate(networks):
            station = network.stations[look % len(masts)]
            away = np.linalg.norm(path - station.position_m, axis=1)
            elements = np.prod(network.transmit) * np.prod(network.receive)
            one = network.power * elements * wave**2 / ((4 * np.pi) ** 3 * away**4)
            signal = received_signal(
                Scene(network, config["seed"], None, effects), station, cloud, row
            ).signal
            found[which, look] = np.mean(abs(signal) ** 2 / one)
    level, in_cells, in_beams = 10 * np.log10(found.mean(axis=1))
    error = 10 / np.log(10) * found[0].std() / found[0].mean() / np.sqrt(looks)
    stated = mean_cross_section.mean_dbsm(cloud.like, mean_cross_section.size_m(cloud))
    added = with_cross_sections(Scene(whole, config["seed"], None, effects), cloud).rcs_m2.sum()
    return [
        stated,
        level + stated - 10 * np.log10(added),
        level,
        level - stated,
        error,
        in_cells - level,
        in_beams - in_cells,
    ]


def scenes() -> list[list]:
    """Return the rows of every shipped scene's table."""
    rows = []
    for path in sorted(Path("config/scenes").glob("*.yaml")):
        station, found = scene_levels(Path(), path.stem)
        rows += [
            [path.stem, station, level.name, f"{level.value:.1f}", level.unit] for level in found
        ]
    return rows


def main() -> None:
    """Compute and write the tables."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path)
    options.add_argument("--targets", type=Path)
    options.add_argument("--looks", type=int, default=2000)
    given = options.parse_args()
    if given.out:
        write_csv(given.out, COLUMNS, scenes())
    if given.targets:
        config, records = target_records(Path())
        rows = [
            [name, *(f"{value:.2f}" for value in target_level(config, record, given.looks))]
            for name, record in records.items()
        ]
        write_csv(given.targets, TARGET_COLUMNS, rows)


if __name__ == "__main__":
    main()
