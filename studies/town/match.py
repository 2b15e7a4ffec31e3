"""The paths of the effect `town` matched one by one with those of a ray tracer, Sionna RT, in its
own towns.

One row for each town, kind of target and order of path: how many both have, by how much delay,
direction and gain differ, and how much power the paths carry that one side lacks.
"""

import argparse
import csv
import os
import sys
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from lowalt.config.layers import overlaid
from lowalt.config.network import SPEED_OF_LIGHT, Network, masts_m
from lowalt.extensions.town import image_paths
from lowalt.extensions.town.buildings import read
from lowalt.extensions.town.bundle_loops import blocked
from lowalt.extensions.town.facets import Occluders, Town
from lowalt.extensions.town.town import DEFAULTS
from lowalt.files.atomic import replacing
from lowalt.motion.drawing import region_polygon

CARRIER_HZ = 4.9e9
SLAB_M = 1000.0
"""Thickness of the ray tracer's walls, which here are half spaces; its default of 0.1 m changes
reflections.
"""
DELAY_S = 1e-9
ANGLE_DEG = 0.1
"""Paths match if they differ by less."""
SAME_S = 1e-11
SAME_DEG = 0.05
"""Paths of one side that differ by less are one path that is listed twice: repeats."""
SEED = 42
OTHER_SEEDS = (1, 2)
"""Random seeds of the ray tracer, and of the runs that look for the paths that it lacks."""
HEIGHTS_M = {"drone": (30.0, 150.0), "car": (1.5, 1.5)}
COLUMNS = (
    "town",
    "target",
    "reflections",
    "positions",
    "lowalt",
    "sionna",
    "lowalt_repeats",
    "sionna_repeats",
    "matched",
    "only_lowalt",
    "found_again",
    "only_sionna",
    "delay_ns_max",
    "angle_deg_max",
    "gain_db_median",
    "gain_db_p95",
    "gain_db_max",
    "within_1_db",
    "only_lowalt_power",
    "only_sionna_power",
)


def drawn(
    rng: np.random.Generator,
    corners: np.ndarray,
    heights: tuple[float, float],
    count: int,
    town: Town,
) -> np.ndarray:
    """Return positions (count, 3) m in a triangle of corners (3, 2) m under the open sky, as
    targets have them.
    """
    found: list[np.ndarray] = []
    while len(found) < count:
        u, v = np.sort(rng.random(2))
        place = np.array(
            [*(corners[0] * u + corners[1] * (v - u) + corners[2] * (1 - v)), rng.uniform(*heights)]
        )
        if not blocked(town.occluders, place[None], place[None] + [0.0, 0.0, 1000.0])[0]:
            found.append(place)
    return np.array(found)


def roof_m(occluders: Occluders, place: np.ndarray) -> float:
    """Return the height (m) of the highest surface over a place (2,) m of the plan, 0 where there
    is none.
    """
    low = np.array([*place, -1.0])
    high = np.array([*place, 2000.0])
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if blocked(occluders, middle[None], high[None])[0] else (low, middle)
        )
    return (
        float(high[2])
        if blocked(occluders, low[None] - [0.0, 0.0, 1.0], np.array([[*place, 2000.0]]))[0]
        else 0.0
    )


def of_lowalt(town: Town, epsilon: np.ndarray, mast: np.ndarray, place: np.ndarray) -> list[tuple]:
    """Return (reflections, delay s, unit vector from the mast, gain) of each path to a place."""
    places = place[None, None]
    wavelength = SPEED_OF_LIGHT / CARRIER_HZ
    rays = image_paths.rays_to(places, 0.0)
    lit, _ = image_paths.direct(town, mast, places, rays, wavelength, False)
    images = [(0, place, 1.0)] if lit[0, 0] else []
    for route in image_paths.reflected(town, epsilon, mast, places, rays, 2):
        images.append((len(route.facets), route.images[0, 0], abs(route.coefficient[0, 0])))
    result = []
    for count, image, coefficient in images:
        length = float(np.linalg.norm(image - mast))
        gain = coefficient * wavelength / (4 * np.pi * length)
        result.append((count, length / SPEED_OF_LIGHT, (image - mast) / length, gain))
    return result


def ray_tracer(llvm: str | None):
    """Return the module of the ray tracer, on the CPU; llvm: path of its libLLVM.so, None for the
    one it finds.
    """
    if llvm:
        os.environ["DRJIT_LIBLLVM_PATH"] = llvm
    import mitsuba

    mitsuba.set_variant("llvm_ad_mono_polarized")
    import sionna.rt

    return sionna.rt


def of_sionna(
    rt, scene, mast: np.ndarray, samples: int, places: np.ndarray, seed: int = SEED
) -> list[list[tuple]]:
    """Return the same of the ray tracer for each of some places (K, 3) m."""
    for name in [*scene.transmitters, *scene.receivers]:
        scene.remove(name)
    scene.add(rt.Transmitter("mast", mast.tolist()))
    for k, place in enumerate(places):
        scene.add(rt.Receiver(f"place{k:03d}", place.tolist()))
    paths = rt.PathSolver()(
        scene,
        max_depth=2,
        samples_per_src=samples,
        los=True,
        specular_reflection=True,
        diffuse_reflection=False,
        refraction=False,
        diffraction=False,
        synthetic_array=True,
        seed=seed,
    )
    gains, delays = paths.cir(normalize_delays=False, out_type="numpy")
    gains = abs(gains[:, 0, 0, 0, :, 0])
    delays = np.reshape(delays, (len(places), -1))
    theta, phi = (
        np.reshape(angle.numpy(), (len(places), -1)) for angle in (paths.theta_t, paths.phi_t)
    )
    counts = (paths.interactions.numpy() != 0).sum(axis=0).reshape(len(places), -1)
    result = []
    for k in range(len(places)):
        there = np.flatnonzero((gains[k] > 0) & (delays[k] > 0))
        way = np.stack(
            [
                np.sin(theta[k]) * np.cos(phi[k]),
                np.sin(theta[k]) * np.sin(phi[k]),
                np.cos(theta[k]),
            ],
            axis=1,
        )
        result.append(
            [(int(counts[k, p]), float(delays[k, p]), way[p], float(gains[k, p])) for p in there]
        )
    return result


def apart_deg(first: tuple, second: tuple) -> float:
    """Return the angle between the directions of two paths."""
    return float(np.degrees(2 * np.arcsin(np.linalg.norm(first[2] - second[2]) / 2)))


def once(paths: list[tuple]) -> tuple[list[tuple], int]:
    """Return the paths of one order, the strongest first, without repeats, and the number of
    repeats.
    """
    kept: list[tuple] = []
    for path in sorted(paths, key=lambda path: -path[3]):
        if not any(
            abs(path[1] - old[1]) < SAME_S and apart_deg(path, old) < SAME_DEG for old in kept
        ):
            kept.append(path)
    return kept, len(paths) - len(kept)


def matched(mine: list[tuple], theirs: list[tuple]) -> tuple[list[tuple], list[tuple], list[tuple]]:
    """Return the pairs of paths of one order that are one, and the paths that only either side has."""
    pairs = []
    left = list(theirs)
    for path in mine:
        near = [
            other
            for other in left
            if abs(other[1] - path[1]) < DELAY_S and apart_deg(path, other) < ANGLE_DEG
        ]
        if near:
            best = min(near, key=lambda other: abs(other[1] - path[1]))
            left = [other for other in left if other is not best]
            pairs.append((path, best))
    held = {id(path) for path, _ in pairs}
    return pairs, [path for path in mine if id(path) not in held], left


def found_again(
    tracer: Callable[[np.ndarray, int], list[list[tuple]]], alone: list[tuple[np.ndarray, tuple]]
) -> list[tuple]:
    """Return those of our paths, each with its place (3,) m, that the ray tracer finds with
    OTHER_SEEDS.

    tracer: returns its paths to some places (K, 3) m with a seed.
    """
    found = []
    left = alone
    for seed in OTHER_SEEDS:
        if left:
            others = tracer(np.array([place for place, _ in left]), seed)
            there = [
                bool(matched([path], [other for other in listed if other[0] == path[0]])[0])
                for (_, path), listed in zip(left, others, strict=True)
            ]
            found += [path for (_, path), is_there in zip(left, there, strict=True) if is_there]
            left = [each for each, is_there in zip(left, there, strict=True) if not is_there]
    return found


def main(arguments: list[str]) -> None:
    """Match the paths in the towns that are named, and write the table."""
    line = argparse.ArgumentParser(description=__doc__)
    line.add_argument("--towns", nargs="+", default=["simple_street_canyon", "munich", "etoile"])
    line.add_argument("--positions", type=int, default=25, help="of each kind of target")
    line.add_argument(
        "--samples", type=int, default=1_000_000, help="rays that the ray tracer starts with"
    )
    line.add_argument("--llvm", help="path of libLLVM.so of version 19")
    line.add_argument("--out", type=Path, required=True)
    options = line.parse_args(arguments)
    rt = ray_tracer(options.llvm)
    config = overlaid([])
    network = Network.from_settings(config["network"])
    corners = np.asarray(region_polygon(np.array(masts_m(config["network"]), float), None))
    rows = []
    for name in options.towns:
        file = getattr(rt.scene, name)
        whole = read(DEFAULTS | {"buildings": file, "ground": "concrete"})
        low = np.array(whole.facts["low_m"])[:2]
        high = np.array(whole.facts["high_m"])[:2]
        # The stations' triangle in the middle of the town, shrunk where the town is smaller.
        scale = min(1.0, 0.8 * float((high - low).min()) / 500.0)
        middle = (low + high) / 2
        town = whole.town
        epsilon = image_paths.epsilons(town, CARRIER_HZ, name)
        scene = rt.load_scene(file)
        scene.frequency = CARRIER_HZ
        scene.tx_array = scene.rx_array = rt.PlanarArray(
            num_rows=1, num_cols=1, pattern="iso", polarization="V"
        )
        for material in scene.radio_materials.values():
            material.thickness = SLAB_M
        inside = middle + scale * (corners - corners.mean(axis=0))
        rng = np.random.default_rng(63)
        for target, heights in HEIGHTS_M.items():
            places = drawn(rng, inside, heights, options.positions, town)
            found: dict[int, list[list]] = defaultdict(lambda: [[] for _ in range(8)])
            for station in network.stations:
                ground = middle + scale * (np.array(station.position_m[:2]) - corners.mean(axis=0))
                above = roof_m(town.occluders, ground)
                mast = np.array([*ground, max(station.position_m[2], above + 3.0)])
                alone: list[tuple[np.ndarray, tuple]] = []
                tracer = partial(of_sionna, rt, scene, mast, options.samples)
                theirs = tracer(places)
                for place, other in zip(places, theirs, strict=True):
                    mine = of_lowalt(town, epsilon, mast, place)
                    for count in range(3):
                        sides = [
                            once([path for path in side if path[0] == count])
                            for side in (mine, other)
                        ]
                        both, repeats = zip(*sides, strict=True)
                        news = (*both, *matched(*both), *([number] for number in repeats))
                        for held, new in zip(found[count], news, strict=False):
                            held += new
                        alone += [(place, path) for path in news[3]]
                for path in found_again(tracer, alone):
                    found[path[0]][7].append(path)
            for count, sides in sorted(found.items()):
                rows.append(
                    (name, target, count, len(places) * len(network.stations), *compared(*sides))
                )
                print(dict(zip(COLUMNS, rows[-1], strict=True)), file=sys.stderr, flush=True)
    with replacing(options.out) as temporary, temporary.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([COLUMNS, *rows])


def compared(
    ours: list,
    others: list,
    pairs: list,
    alone: list,
    missed: list,
    repeats: list,
    others_repeats: list,
    again: list,
) -> tuple:
    """Return the columns of a line that say how well the paths agree; repeats: numbers of them,
    left out before;
    again: those of `alone` that the ray tracer finds with another seed."""
    delays = [1e9 * abs(a[1] - b[1]) for a, b in pairs]
    angles = [apart_deg(*pair) for pair in pairs]
    gains = [abs(20 * np.log10(a[3] / b[3])) for a, b in pairs]
    power = [sum(path[3] ** 2 for path in side) for side in (alone, missed, ours)]
    shares = [f"{part / power[2] if power[2] else 0.0:.2e}" for part in power[:2]]
    numbers = [""] * 6
    if pairs:
        numbers = [f"{np.max(delays):.4f}", f"{np.max(angles):.4f}"]
        numbers += [f"{np.percentile(gains, share):.3f}" for share in (50, 95, 100)]
        numbers.append(f"{np.mean(np.array(gains) < 1.0):.4f}")
    counts = (
        len(ours),
        len(others),
        sum(repeats),
        sum(others_repeats),
        len(pairs),
        len(alone),
        len(again),
        len(missed),
    )
    return *counts, *numbers, *shares


if __name__ == "__main__":
    main(sys.argv[1:])
