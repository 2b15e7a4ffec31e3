"""Levels of one sample in every shipped scene, as a link budget lists them.

    python benchmarks/scene_levels.py --out results/benchmarks/scene_levels.csv

The sample is the first motion model of the DJI Mavic 3 Pro at the first station, or on the first link; the same lines
as `lowalt explain SCENE --sample "DJI Mavic 3 Pro:0" --no-cost` prints.
"""

import argparse
from pathlib import Path

from lowalt.common.config import load
from lowalt.common.csv_tables import write_csv
from lowalt.common.network import Network
from lowalt.effects.catalogue import called
from lowalt.effects.explain import samples
from lowalt.effects.interface import PointsBeams, SamplesTime, SetsCrossSections, ShapesElements, WeighsPoints
from lowalt.effects.levels import Level, levels
from lowalt.effects.received import Scene, observe, received_signal, with_cross_sections

COLUMNS = ("scene", "station", "level", "value", "unit")
SAMPLE = "DJI Mavic 3 Pro", 0
OWN = (SetsCrossSections, ShapesElements, WeighsPoints, PointsBeams, SamplesTime)
"""Protocols of the effects that act on the target's own echo on the direct path."""


def scene_levels(root: Path, name: str) -> tuple[str, list[Level]]:
    """Return the station and the levels of the sample in a shipped scene; root: the repository's folder."""
    paths = [root / "config/default.yaml", root / f"config/scenes/{name}.yaml"]
    config = load(paths, root / "workflow/schemas/config.schema.yaml")
    config["targets"]["table"] = str(root / config["targets"]["table"])
    config["targets"]["records"] = [str(root / path) for path in config["targets"]["records"]]
    network, every = Network.from_settings(config["network"]), called(config["effects"])
    alone = tuple(one for one in every if one.place == "motion" or isinstance(one.module, OWN))
    sample = samples(config, None, [SAMPLE])[0]
    links = [station for station in network.stations if station.transmitter is not None]
    station = (links or network.stations)[0]
    scene = Scene(network, config["seed"], None, alone)
    view = observe(scene, station, with_cross_sections(scene, sample.cloud), sample.row, sample.occluders)
    power = received_signal(scene, station, sample.cloud, sample.row, sample.occluders).power
    return station.name, levels(view, {one.name: one for one in every}, power)


def main() -> None:
    """Compute and write the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--out", type=Path, required=True)
    rows = []
    for path in sorted(Path("config/scenes").glob("*.yaml")):
        station, found = scene_levels(Path(), path.stem)
        rows += [[path.stem, station, level.name, f"{level.value:.1f}", level.unit] for level in found]
    write_csv(options.parse_args().out, COLUMNS, rows)


if __name__ == "__main__":
    main()
