"""Built-in car models: a lower body, a greenhouse by the car's profile, and four turning wheels.

A bus is one box.

Axes: front +y, right +x, up +z, metres. The origin lies in the middle of length, width and height,
so that it is half the height above the ground. Of the figures, heights are relative to the height;
stations along the car are distances from the front bumper, relative to its length; `roof_width` is
relative to the width. `rolling_diameter` is that of the tyre, used where the record says
`wheel_size: rolling`; by default the wheel has the published (rim) diameter. The factors in the code
are estimates of usual proportions, as shares of the figures.
"""

from itertools import pairwise

import numpy as np

from lowalt.numerics import portable
from lowalt.targets.assemble import Part
from lowalt.targets.record_schema import figures_si
from lowalt.targets.surfaces import Surface, box, cylinder, hull, loft, ring, superellipse

SPOKES = 5
"""Spokes of a wheel; estimate."""
MOVING_SHARE = 0.35
"""Share of a cloud's points on the wheels where the record has no `moving_share`; estimate.

Echo strength goes with the count of points, so it is also the wheels' share of the echo.
"""
HOOD_END = 0.18
"""Where the hood's level section ends, as a share of the car's length from the nose."""


def fault(record: dict) -> str | None:
    """Return the reason why a merged record is no car, or None."""
    figures = figures_si(record)
    table = record["published"]
    axle = figures["front_overhang"] + figures["wheel_base"]
    if axle >= table["len_m"]:
        return (
            f"figures front_overhang + wheel_base are {axle:.4g} m, expected less than the "
            f"{table['len_m']} m length"
        )
    if figures["track"] >= table["wid_m"]:
        return (
            f"figures.track is {figures['track']:.4g} m, expected less than the {table['wid_m']} m"
            " width"
        )
    if record["model"] == "bus":
        return None
    return _profile_fault(figures, table)


def _profile_fault(figures: dict, table: dict) -> str | None:
    """The fault in the figures of a car's side view, or None where they describe a car."""
    names = ("windshield_base", "roof_front", "roof_rear", "rear_glass_base")
    stations = [figures[name] for name in names]
    rising = [HOOD_END, *stations, 1]
    if any(behind >= ahead for behind, ahead in pairwise(rising)):
        return (
            f"figures windshield_base to rear_glass_base are {stations}, expected rising from "
            f"{HOOD_END} to 1"
        )
    clearance = figures["ground_clearance"] / table["hgt_m"]
    hood = figures["hood_height"]
    belt = figures["belt_height"]
    if not clearance < hood <= belt < 1 or not clearance < figures["deck_height"] < 1:
        return (
            f"figures ground_clearance, hood and belt are {[clearance, hood, belt]} of the height, "
            "expected rising and below 1"
        )
    return None


def _lower(length: float, width: float, height: float, figures: dict) -> Surface:
    """The body up to hood, belt and deck, as rounded sections along the car."""
    floor = -height / 2 + figures["ground_clearance"]
    bottom = -height / 2
    hood = bottom + figures["hood_height"] * height
    belt = bottom + figures["belt_height"] * height
    deck = bottom + figures["deck_height"] * height
    nose = floor + 0.55 * (hood - floor)
    tail = floor + 0.35 * (deck - floor)
    half = width / 2
    lift = 0.06 * height
    # Distance from the front and width, as shares of the length and width; lower and upper edge (m).
    rows = [
        (0.0, 0.72, floor + lift, nose),
        (0.02, 0.86, floor + 0.5 * lift, 0.3 * nose + 0.7 * hood),
        (0.08, 0.96, floor, hood),
        (HOOD_END, 1.0, floor, hood + 0.25 * (belt - hood)),
        (figures["windshield_base"], 1.0, floor, belt),
        (min(figures["rear_glass_base"], 0.94), 1.0, floor, max(belt, deck)),
        (0.97, 0.93, floor + 0.5 * lift, deck),
        (1.0, 0.82, floor + lift, max(tail, deck - 0.12 * height)),
    ]
    stations = []
    for from_front, wide, low, high in rows:
        stations.append((length * (0.5 - from_front), wide * half, low, high))
    return hull(stations, exponent=4.5, sides=32)


def _greenhouse(length: float, width: float, height: float, figures: dict) -> Surface:
    """The cabin above the belt: rounded plan rings from the belt up to the roof."""
    bottom = -height / 2
    belt = bottom + (min(figures["belt_height"], figures["deck_height"]) - 0.1) * height
    base = length * (0.5 - np.array([figures["windshield_base"], figures["rear_glass_base"]]))
    roof = length * (0.5 - np.array([figures["roof_front"], figures["roof_rear"]]))
    rings = []
    # Height of a ring over the belt, as a share of the way to the roof, and its size over that of
    # the straight sides: the edge of the roof is rounded.
    for up, shrink in ((0.0, 1.0), (0.5, 1.0), (0.85, 1.0), (0.96, 0.97), (1.0, 0.88)):
        ends = base + up * (roof - base)
        middle = ends.mean()
        half_length = abs(np.ptp(ends)) / 2 * shrink
        half_width = width / 2 * (0.96 + up * (figures["roof_width"] - 0.96)) * shrink
        loop = superellipse(half_width, half_length, 4.0, 32)
        z = belt + up * (height / 2 - belt)
        rings.append(np.stack([loop[:, 0], loop[:, 1] + middle, np.full(32, z)], 1))
    return loft(np.array(rings))


def _coach(length: float, width: float, height: float, figures: dict) -> Surface:
    """The body of a bus: one box with rounded edges and a slightly slanted front."""
    floor = -height / 2 + figures["ground_clearance"]
    top = height / 2
    # Position to the front and width, as shares of the length and width; lower and upper edge (m).
    rows = [
        (0.5, 0.9, floor + 0.1 * height, 0.86 * top),
        (0.492, 0.98, floor, 0.95 * top),
        (0.47, 1.0, floor, top),
        (-0.49, 1.0, floor, top),
        (-0.5, 0.95, floor + 0.05 * height, 0.96 * top),
    ]
    stations = [(length * y, w * width / 2, low, high) for y, w, low, high in rows]
    return hull(stations, exponent=7.0, sides=32)


def wheel(diameter: float, tyre_width: float) -> tuple[Surface, ...]:
    """Return a wheel about the x axis at the origin, as closed shells: tyre, hub and spokes.

    Its lowest point is at z = -diameter / 2.
    """
    radius = diameter / 2
    half = tyre_width / 2
    inner = 0.62 * radius
    section = superellipse((radius - inner) / 2, half, 3.5, 16)
    loop = section + np.array([(radius + inner) / 2, 0])
    # `ring` turns about z. The map takes z to x, so that one section of the tyre points straight
    # down.
    to_x = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    shells = [
        ring(loop, 32).mapped(to_x),
        cylinder(0.16 * radius, (-0.5 * half, 0, 0), (0.6 * half, 0, 0)),
    ]
    side = np.array([1.0, 0, 0])
    section = superellipse(0.12 * radius, 0.2 * half, 4.0, 8)
    for k in range(SPOKES):
        sine, cosine = portable.sine_cosine_turns(k / SPOKES)
        out = np.array([0, cosine, sine])
        across = np.array([0, -sine, cosine])
        ends = []
        for r in (0.1 * radius, 1.04 * inner):
            middle = out * r + 0.35 * half * side
            ends.append(middle + section[:, :1] * across + section[:, 1:] * side)
        shells.append(loft(np.array(ends)))
    return tuple(shells)


def parts(record: dict) -> tuple[list[Part], dict]:
    """Return the parts of the car that a merged record describes.

    The entries for its cloud's record come second: `wheel_diameter_m`, which sets the wheels' rate,
    and `origin_height_m`, the height of the origin above the ground on which the wheels stand.
    """
    figures = figures_si(record)
    table = record["published"]
    length = table["len_m"]
    width = table["wid_m"]
    height = table["hgt_m"]
    diameter = table["wheel_diam_m"]
    if record.get("wheel_size", "published") == "rolling":
        diameter = figures["rolling_diameter"]
    front = length / 2 - figures["front_overhang"]
    tyre = figures["tyre_width"]
    # Wheels stay inside the body's width, flush with its sides where the track is wide.
    across = min(figures["track"] / 2, width / 2 - tyre / 2)
    shells = wheel(diameter, tyre)
    mirror = np.diag([-1.0, 1.0, 1.0])
    wheels = []
    wells = []
    for name, y in (("front", front), ("rear", front - figures["wheel_base"])):
        for side, word in ((-1, "left"), (1, "right")):
            centre = (side * across, y, -height / 2 + diameter / 2)
            on_side = shells
            if side < 0:
                on_side = tuple(shell.mapped(mirror) for shell in shells)
            placed = tuple(shell.moved(centre) for shell in on_side)
            wheels.append(Part(f"{name} {word} wheel", "wheel", placed, centre, (-1.0, 0.0, 0.0)))
            inside = (side * (across - 0.6 * tyre), *centre[1:])
            outside = (side * width, *centre[1:])
            wells.append(cylinder(0.56 * diameter, inside, outside, 24))
    # No station sees a car from below, so the underside between the sills gets no points.
    floor = figures["ground_clearance"] + 0.06 * height
    wells.append(box((0.86 * width, 1.1 * length, 2 * floor), (0, 0, -height / 2)))
    if record["model"] == "car":
        skins: tuple[Surface, ...] = (
            _lower(length, width, height, figures),
            _greenhouse(length, width, height, figures),
        )
    else:
        skins = (_coach(length, width, height, figures),)
    body = Part("body", "body", skins, cuts=tuple(wells))
    facts = {"wheel_diameter_m": diameter, "origin_height_m": height / 2}
    return [body, *wheels], facts
