"""Random scenes over the whole configuration space: the echo at each tolerance against an
independent reference.

    python benchmarks/echo_scenes.py --count 10000 [--seed 1] [--out
    results/benchmarks/echo_scenes.csv]

Ranges 1 m to 100 km, 1 to 5000 points, 0.5 to 100 GHz, any array sizes. Each scene is compared at
eight random symbols and the two deepest fades. The reference (`judge`) sums elements and
subcarriers one by one, its ranges in extended precision; it shares nothing with the closed form. A
tolerance below a scene's floor is refused, which is counted, not judged. In every second scene the
cheap plan of a tolerance is tried even where the exact mode would be as fast.
"""

import argparse
import csv
import sys
import time
from pathlib import Path
from unittest.mock import patch

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo import Rigid, echo_signal, refine
from lowalt.files.atomic import replacing
from lowalt.files.errors import BelowFloor
from lowalt.measure.echo_cost import hardware
from lowalt.numerics.streams import stream

TOLERANCES = (1e-3, 1e-6, 1e-9)
SYMBOLS = 48
PRICES = (refine.PROBE_COST, -np.inf)
"""What a cheap plan must save: as shipped, and nothing, so that it is always tried."""
NEAR_TIE = 1e-12


def scene(seed: int, index: int) -> tuple[Network, Station, Rigid, np.ndarray, np.ndarray]:
    """Return scene `index`: network, station, motion, cross sections and aim."""
    rng = stream(seed, "benchmark scene", index)
    carrier = 10 ** rng.uniform(np.log10(0.5e9), 11)
    elements = [round(2 ** rng.uniform(0, 5.5)) for _ in range(4)]
    network = Network(
        carrier,
        float(rng.choice([15e3, 60e3, 120e3, 480e3])),
        round(2 ** rng.uniform(0, 9)),
        10,
        2.5e-3,
        SYMBOLS,
        (elements[0], elements[1]),
        (elements[2], elements[3]),
        1.0,
        (Station("A", (0.0, 0.0, 0.0), 0.0, carrier),),
    )
    place = rng.normal(scale=100, size=3)
    station = Station(
        "A", tuple(place), rng.uniform(0, 2 * np.pi), carrier * (1 + 0.02 * rng.uniform())
    )
    away = 10 ** rng.uniform(0, 5)
    direction = rng.normal(size=3)
    direction *= away / np.linalg.norm(direction)
    count = round(10 ** rng.uniform(0, np.log10(5000)))
    parts = int(rng.integers(1, 7))
    size = min(10 ** rng.uniform(-2, 1), 0.4 * away)
    points = rng.normal(scale=size / 3, size=(count, 3))
    axes = rng.normal(size=(parts, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angle = np.arange(SYMBOLS)[:, None] * rng.uniform(0, 3, parts) * rng.integers(0, 2, parts)
    cross = np.cross(np.eye(3)[None], axes[:, None])
    turned = np.cos(angle)[..., None, None] * np.eye(3) + np.sin(angle)[..., None, None] * cross
    outer = axes[:, :, None] * axes[:, None, :]
    rotation = turned + (1 - np.cos(angle))[..., None, None] * outer
    # Slower than 0.2 of the distance over the look, so that nothing passes through the station.
    velocity = rng.normal(size=3)
    velocity *= (
        min(60.0, 0.2 * away / (SYMBOLS * 2.5e-3)) * rng.uniform() / np.linalg.norm(velocity)
    )
    path = place + direction + np.arange(SYMBOLS)[:, None] * 2.5e-3 * velocity
    translation = path[:, None] + rng.normal(scale=size / 5, size=(parts, 3))
    motion = Rigid(rotation, translation, points, rng.integers(0, parts, count))
    return network, station, motion, rng.exponential(size=count), path[0]


def judge(network: Network, station: Station, motion: Rigid, rcs_m2, aim_m, n: int) -> np.ndarray:
    """All cells (M,) of symbol n by plain sums over array elements and subcarriers, ranges in
    extended precision.
    """
    wide = np.longdouble
    place = np.array(station.position_m, wide)
    turned = (
        motion.rotation[n, motion.part].astype(wide) * motion.points[:, None, :].astype(wide)
    ).sum(axis=2)
    offset = (motion.translation[n, motion.part].astype(wide) - place) + turned
    kappa = wide(station.frequency_hz) / wide(network.carrier_hz)
    sine = np.sin(wide(station.normal_rad))
    cosine = np.cos(wide(station.normal_rad))

    def look(d):
        """Return range and both direction cosines of vectors d (..., 3) from the station."""
        r = np.sqrt((d * d).sum(axis=-1))
        return r, (cosine * d[..., 1] - sine * d[..., 0]) / r, d[..., 2] / r

    r, psi, omega = look(offset)
    _, psi0, omega0 = look(np.asarray(aim_m, wide) - place)
    gain = np.ones(len(r), complex)
    for counts in (network.transmit, network.receive):
        for number, cosines in zip(counts, (psi - psi0, omega - omega0), strict=True):
            step = (kappa * cosines / 2).astype(float)
            gain *= np.exp(2j * np.pi * np.outer(np.arange(number), step)).sum(axis=0)
    light = wide(299792458)
    start = 2 * wide(station.frequency_hz) * r / light
    step = 2 * wide(network.subcarrier_spacing_hz) * r / light
    start = (start - np.rint(start)).astype(float)
    step = (step - np.rint(step)).astype(float)
    amplitude = (
        np.sqrt(rcs_m2)
        / ((4 * np.pi) ** 1.5 * r.astype(float) ** 2)
        * SPEED_OF_LIGHT
        / network.carrier_hz
    )
    wave = amplitude * gain * np.exp(-2j * np.pi * start)
    y = np.exp(-2j * np.pi * np.outer(np.arange(network.subcarriers), step)) @ wave
    elements = np.prod(network.transmit) * np.prod(network.receive)
    return np.sqrt(network.power / elements) * np.fft.ifft(y)


def examine(seed: int, index: int) -> list[dict]:
    """Compare one scene with the reference at every tolerance (None: exact, held to 1e-9); return a
    row each.
    """
    network, station, motion, rcs, aim = scene(seed, index)
    rows = []
    truth = {}
    rng = stream(seed, "judged symbols", index)
    chosen = set(rng.choice(SYMBOLS, 8, replace=False).tolist())
    for tolerance in (None, *TOLERANCES):
        row = {
            "scene": index,
            "tolerance": tolerance or 0.0,
            "points": len(rcs),
            "carrier_hz": network.carrier_hz,
            "range_m": float(np.linalg.norm(aim - np.array(station.position_m))),
            "subcarriers": network.subcarriers,
        }
        try:
            with (
                patch.object(refine, "PROBE_COST", PRICES[index % 2]),
            ):
                result = echo_signal(
                    network, station, motion, rcs, aim, tolerance, sample=f"scene {index}"
                )
        except BelowFloor:
            rows.append(
                row | {"refused": 1, "error": 0.0, "bound": 0.0, "wrong_cells": 0, "near_ties": 0}
            )
            continue
        largest = abs(result.signal).max()
        if not truth:
            chosen |= set(np.argsort(abs(result.signal))[:2].tolist())
            truth = {n: judge(network, station, motion, rcs, aim, n) for n in sorted(chosen)}
        worst = 0.0
        wrong = 0
        ties = 0
        for n, cells in truth.items():
            strength = abs(cells)
            best = int(strength.argmax())
            if result.cell[n] != best:
                # A gap below the rounding of the reference's double sums counts as a near-tie.
                noise = max(NEAR_TIE * strength[best], 1e-13 * largest)
                ties = ties + (strength[best] - strength[result.cell[n]] <= noise)
                wrong = wrong + (strength[best] - strength[result.cell[n]] > noise)
            worst = max(worst, abs(result.signal[n] - cells[result.cell[n]]) / largest)
        rows.append(
            row
            | {
                "refused": 0,
                "error": worst,
                "bound": result.bound,
                "wrong_cells": wrong,
                "near_ties": ties,
            }
        )
    return rows


def failures(rows: list[dict]) -> list[dict]:
    """Return the rows whose error is above the tolerance or above the proved bound, or whose cell
    is wrong.

    The reference's own error is allowed on top of the bound: 3e-12 of its double sums, and eight
    roundings of its 64-bit mantissas in the turns of phase. Where both differ by so much, 50 digits
    agree with the echo.
    """
    bad = []
    for row in rows:
        turns = 2 * row["carrier_hz"] * row["range_m"] / SPEED_OF_LIGHT
        judged = 3e-12 + 2 * np.pi * 8 * float(np.finfo(np.longdouble).eps) / 2 * turns
        if (
            row["error"] > (row["tolerance"] or 1e-9)
            or row["error"] > row["bound"] + judged
            or row["wrong_cells"]
        ):
            bad.append(row)
    return bad


def main() -> None:
    """Run the scenes, write the table and print the failures."""
    line = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    line.add_argument("--count", type=int, default=10_000)
    line.add_argument("--seed", type=int, default=1)
    line.add_argument("--out", type=Path, default=Path("results/benchmarks/echo_scenes.csv"))
    given = line.parse_args()
    start = time.time()
    rows = []
    for index in range(given.count):
        rows += examine(given.seed, index)
        if (index + 1) % 500 == 0:
            print(
                f"{index + 1} scenes, {time.time() - start:.0f} s, {len(failures(rows))} failures",
                file=sys.stderr,
            )
    columns = [
        "tolerance",
        "scenes",
        "judged",
        "refused",
        "largest_error",
        "median_error",
        "wrong_cells",
        "near_ties",
        "failures",
        "seconds",
        "hardware",
    ]
    with replacing(given.out) as temporary, temporary.open("w", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        for tolerance in (0.0, *TOLERANCES):
            mine = [row for row in rows if row["tolerance"] == tolerance]
            seen = [row for row in mine if not row["refused"]]
            writer.writerow(
                {
                    "tolerance": tolerance or "exact",
                    "scenes": len(mine),
                    "judged": len(seen),
                    "refused": len(mine) - len(seen),
                    "largest_error": max((row["error"] for row in seen), default=0.0),
                    "median_error": float(np.median([row["error"] for row in seen]))
                    if seen
                    else 0.0,
                    "wrong_cells": sum(row["wrong_cells"] for row in seen),
                    "near_ties": sum(row["near_ties"] for row in seen),
                    "failures": len(failures(mine)),
                    "seconds": round(time.time() - start, 1),
                    "hardware": hardware(),
                }
            )
    print(given.out.read_text(), end="")
    bad = failures(rows)
    for row in bad[:10]:
        print(f"FAILED {row}", file=sys.stderr)
    print(
        f"{given.count} scenes, {len(bad)} failures, {time.time() - start:.0f} s", file=sys.stderr
    )
    raise SystemExit(bool(bad))


if __name__ == "__main__":
    main()
