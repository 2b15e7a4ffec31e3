"""Whether the echo of a single point appears where the observed truth says, in every scene and at
every station.

    python benchmarks/observed_truth.py --out results/reference/observed_truth.csv

Each look has one isotropic point in uniform motion, and those effects of a scene that neither add
noise nor other echoes. `cells` is the largest distance of a symbol's strongest range cell from the
observed cell, `bins` the largest distance of the range-Doppler map's peak from the observed speed
of the nearest symbol, in speeds of the map. Both are at most a half where the truth is right.
`geometric_cells` and `geometric_bins` are the same for the geometric truth.
"""

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.config.layers import load
from lowalt.config.network import Network, Station
from lowalt.files.csv_tables import write_csv
from lowalt.motion.table import NUMBERS
from lowalt.numerics.streams import stream
from lowalt.scene.effects import NamedEffect, called
from lowalt.scene.observe import Scene
from lowalt.spectra.cube import TRUTH, Cube
from lowalt.spectra.kinds import range_doppler
from lowalt.targets.cloud import Cloud
from lowalt.tiles.cubes import Cubes

COLUMNS = (
    "scene",
    "waveform",
    "symbols",
    "looks",
    "cells",
    "bins",
    "geometric_cells",
    "geometric_bins",
)
OTHERS = (
    "scatter",
    "from_sender",
    "heard",
    "companions",
    "paths",
    "routes",
    "visible",
    "visible_one_way",
    "cross_sections",
    "filtered",
    "choose",
)
"""Functions of the effects that add other echoes, change the target's amplitude, or act behind the
receiver.
"""
NOISE = ("receiver_noise", "cell_noise", "phase_noise", "transmit_leakage")
FURTHER: dict[str, tuple[str, dict]] = {
    "links, 0.017 ppm": ("links", {"effects": {"link_offset": {}}}),
    "continuous wave": ("fmcw", {"network": {"waveform": {"kind": "cw"}}, "effects": {}}),
}
"""Scenes beyond the shipped ones: the scene that each starts from, and what replaces its blocks."""
SYMBOLS = (64, 65)
LOOKS = 6
"""Symbols of a look, and looks at each station."""


class Distance(NamedTuple):
    """Of one look: distances of the echo from the observed and from the geometric truth."""

    cells: float
    bins: float
    geometric_cells: float
    geometric_bins: float


def block_of(root: Path, name: str) -> dict:
    """Return the configuration of a shipped scene or one of FURTHER; root: the repository's folder."""
    base, changes = FURTHER.get(name, (name, {}))
    paths = [root / "config/default.yaml", root / f"config/scenes/{base}.yaml"]
    config = load(paths, root / "workflow/schemas/config.schema.yaml")
    network = config["network"] | changes.get("network", {})
    return config | {"network": network, "effects": changes.get("effects", config["effects"])}


def alone(effects: list[NamedEffect]) -> tuple[NamedEffect, ...]:
    """Return the effects that leave a single echo without noise."""
    return tuple(
        effect
        for effect in effects
        if effect.name not in NOISE and not any(hasattr(effect.module, name) for name in OTHERS)
    )


def point() -> Cloud:
    """Return a target of a single point of 1 m2."""
    nothing = np.full((1, 3), np.nan)
    return Cloud(
        points=np.zeros((1, 3)),
        part=np.zeros(1, int),
        kinds=("body",),
        names=("body",),
        parents=np.array([-1]),
        hinges=nothing,
        axes=nothing,
        normals=nothing,
        rcs_m2=np.ones(1),
        record={
            "subtype": "Point",
            "category": "UAV",
            "source": "",
            "checksum": "",
            "published": {"size_m": 0.4},
        },
    )


def course(network: Network, scene: str, look: int) -> dict:
    """Return a row of the motion table: a place between the stations, a speed up to 40 m/s in any
    direction.
    """
    rng = stream(1, "observed truth", scene, look)
    masts = np.array([station.position_m for station in network.stations])
    middle = masts.mean(axis=0)
    extent = float(np.ptp(masts[:, 0]))
    place = middle + np.array(
        [*(0.2 * extent * rng.uniform(-1, 1, 2)), 0.1 * extent * rng.random()]
    )
    way = rng.standard_normal(3) * [1, 1, 0.2]
    velocity = 40 * rng.uniform(-1, 1) * way / np.linalg.norm(way)
    numbers = dict(
        zip(("x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"), (*place, *velocity), strict=True)
    )
    level = {"yaw_rad": 0.0, "pitch_rad": 0.0, "roll_rad": 0.0}
    texts = {"subtype": "Point", "category": "UAV", "group": "seen", "model": look}
    return dict.fromkeys(NUMBERS, np.nan) | texts | level | numbers


def distance(cube: Cube, network: Network, station: Station) -> Distance:
    """Return how far the echo of a cube without noise is from what is true of it."""
    there = cube.chosen >= 0
    symbols, count = cube.cells.shape
    truth = dict(zip(TRUTH, cube.truth.T, strict=True))
    settings = range_doppler.Settings(max(count - 1 + count % 2, 3), symbols)
    power = range_doppler.definition(cube, settings)
    seen_mps = network.bin_speeds_mps(symbols, station)[
        np.unravel_index(power.argmax(), power.shape)[1]
    ]
    step_mps = 2 * network.largest_mps(station) / symbols
    strongest = abs(cube.cells[there]).argmax(axis=1)

    def cells(where: np.ndarray) -> float:
        """Largest distance of the strongest cells from a truth (N,); cells wrap around as ranges
        do.
        """
        return float(abs((strongest - where[there] + count / 2) % count - count / 2).max())

    def bins(speeds_mps: np.ndarray) -> float:
        """Distance of the map's peak from the nearest of a truth (N,)."""
        return float(abs(network.folded_mps(seen_mps - speeds_mps, station)).min() / step_mps)

    return Distance(
        cells(truth["observed_cell"]),
        bins(truth["observed_mps"]),
        cells(truth["range_m"] / network.cell_m % count),
        bins(truth["radial_mps"]),
    )


def distances(config: dict, name: str, symbols: int, looks: int) -> list[Distance]:
    """Return the distances of several looks at every station of a scene."""
    network = Network.from_settings(config["network"] | {"symbols": symbols})
    scene = Scene(
        network, config["seed"], config["echo"]["tolerance"], alone(called(config["effects"]))
    )
    cubes = Cubes(scene, {"Point": point()}, kept=1)
    return [
        distance(cubes.of(course(network, name, look), np.inf, station), network, station)
        for look in range(looks)
        for station in network.stations
    ]


def main() -> None:
    """Compute, print and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--looks", type=int, default=LOOKS, help="at each station")
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    table = []
    for name in (*sorted(path.stem for path in Path("config/scenes").glob("*.yaml")), *FURTHER):
        for symbols in SYMBOLS:
            config = block_of(Path(), name)
            found = np.array(distances(config, name, symbols, given.looks))
            waveform = config["network"].get("waveform", {"kind": "ofdm"})["kind"]
            table.append(
                [
                    name,
                    waveform,
                    symbols,
                    len(found),
                    *(f"{value:.3f}" for value in found.max(axis=0)),
                ]
            )
            print(*table[-1], sep=",", flush=True)
    write_csv(given.out, COLUMNS, table)


if __name__ == "__main__":
    main()
