"""Built-in bird models: body with head, bill and tail, and two wings of two hinged segments each.

Axes: front +y, right +x, up +z, metres; the origin lies half-way between bill tip and tail tip,
wings flat. A positive angle about either hinge raises the wing's tip, on both sides. Of the figures
`length` (bill tip to tail tip) and `span`, those of the living bird, only the ratio is used, since
the published size sets the length. Ratios are relative to the length, with three exceptions:
`wing_chord` is relative to half the span, `wrist` is where the second hinge lies along half the
span, `tip_chord` is the chord at the tip over that at the root. `fingers` is the number of slotted
primaries at the tip. Other numbers in the code are estimates of usual proportions.
"""

import math

import numpy as np

from lowalt.targets.assemble import Part
from lowalt.targets.record_schema import figures_si
from lowalt.targets.surfaces import Surface, ellipsoid, foil, hull, loft, superellipse, tube

FLAP = {"mean_deg": 15.0, "amplitude_deg": 40.0, "fold_amplitude_deg": 30.0, "fold_lag_deg": 90.0}
"""Default wing beat, of the inner and of the outer segment.

The shoulder turns by mean + amplitude cos(2 pi F t), the outer segment by fold_amplitude cos(2 pi F
t - fold_lag).
"""

MOVING_SHARE = 0.62
"""Share of a cloud's points on the wings where the record has no `moving_share`; estimate.

Echo strength goes with the count of points, so it is also the wings' share of the echo.
"""
TRUNK = (
    (-0.04, 0.3),
    (0.05, 0.62),
    (0.2, 0.92),
    (0.4, 1.0),
    (0.65, 0.85),
    (0.85, 0.55),
    (1.0, 0.3),
)
"""The trunk: distance behind the shoulder over that of the tail's root, and width over the body's."""
POINTED_WING = [(0, 0.95), (0.35, 0.81), (0.7, 0.57), (0.92, 0.28)]
BLUNT_WING = [(0, 0.95), (0.35, 0.87), (0.62, 0.76)]
"""Outer segments: distance from the wrist over that of the tip, and chord over that at the root."""
ARM_THICKNESS = 0.11
FEATHER_THICKNESS = 0.06
"""Largest thickness of the inner and of the outer segment over the chord."""


def fault(record: dict) -> str | None:
    """Return the reason why a merged record is no bird, or None."""
    figures = figures_si(record)
    # The trunk between them keeps at least a tenth of the length.
    without_trunk = figures["bill"] + figures["head"] + figures["neck"] + figures["tail"]
    if without_trunk > 0.9:
        return (
            f"figures bill, head, neck and tail add up to {without_trunk:.3g} of the length,"
            " expected at most 0.9"
        )
    if figures["span"] / figures["length"] <= 2 * figures["body_width"]:
        return f"figures.span is {figures['span']:.3g} m, expected more than twice the body's width"
    if not 0.1 <= figures["wrist"] <= 0.9:
        return f"figures.wrist is {figures['wrist']}, expected 0.1 to 0.9 of the wing"
    return None


def _bill(front: float, root: float, depth: float) -> Surface:
    """Return the slightly hooked bill from y = `root`, where it is `depth` high, to `front` (m)."""
    sections = []
    # Position from the root to the tip, size over that at the root, and how far it hangs down (m).
    for along, size, droop in ((0.0, 1.0, 0.0), (0.5, 0.85, 0.0), (0.88, 0.45, -0.12 * depth)):
        loop = superellipse(0.3 * size * depth, 0.5 * size * depth, sides=12)
        y = root + along * (front - root)
        sections.append(np.stack([loop[:, 0], np.full(12, y), loop[:, 1] + droop], 1))
    return loft(np.array(sections), tips=np.array([[0, root, 0], [0, front, -0.2 * depth]]))


def _body(length: float, figures: dict) -> tuple[Surface, ...]:
    """Return bill, head, neck, trunk and tail fan, from the bill's tip at y = +length / 2 to the
    tail's at -length / 2 (m).
    """
    front = length / 2
    bill = figures["bill"] * length
    head = figures["head"] * length
    neck = figures["neck"] * length
    tail = figures["tail"] * length
    half = figures["body_width"] * length / 2
    fan_half = figures["tail_spread"] * length / 2
    thin = 0.03 * length
    skull_y = front - bill - 0.45 * head
    skull = ellipsoid((0.42 * head, 0.55 * head, 0.45 * head), (0, skull_y, 0))
    shoulder = skull_y - neck - 0.25 * head
    root = -front + tail
    reach = shoulder - root
    throat_path = [(0, skull_y, 0), (0, shoulder - 0.12 * reach, 0)]
    throat = tube(throat_path, [0.36 * head, 0.6 * half + 0.1 * head])
    stations = []
    for along, wide in TRUNK:
        half_width = wide * half
        low = -0.95 * wide * half
        high = 0.85 * wide * half
        stations.append((shoulder - along * reach, half_width, low, high))
    trunk = hull(stations, exponent=2.0)
    # Position and half width (m), and half thickness over `thin`.
    feathers = (
        (root + 0.3 * tail, 0.28 * half, 1.0),
        (root - 0.3 * tail, 0.5 * fan_half, 0.4),
        (-front + 0.06 * tail, fan_half, 0.15),
        (-front, 0.86 * fan_half, 0.1),
    )
    fan_stations = []
    for y, half_width, thickness in feathers:
        fan_stations.append((y, half_width, -thickness * thin, thickness * thin))
    fan = hull(fan_stations, exponent=3.0)
    hooked = _bill(front, front - bill - 0.2 * head, figures["bill_depth"] * length)
    return hooked, skull, throat, trunk, fan


def _inner(shoulder: np.ndarray, wrist: np.ndarray, chord: float) -> Surface:
    """Return the inner segment of the right wing, from inside the trunk to the wrist, swept forward.

    shoulder, wrist: the hinges (3,), m; chord: at the root (m).
    """
    x, y, z = shoulder
    half_way = shoulder + (wrist - shoulder) * [0.5, 0.6, 0]
    # Quarter-chord point (m), chord (m), twist (rad).
    root = (x - 0.04 * (wrist[0] - x), y, z, chord, 0.05)
    middle = (*half_way, 0.98 * chord, 0.05)
    tip = (*wrist, 0.95 * chord, 0.04)
    return foil([root, middle, tip], ARM_THICKNESS)


def _outer(wrist: np.ndarray, half_span: float, chord: float, figures: dict) -> tuple[Surface, ...]:
    """Return the outer segment of the right wing, in one shell or several.

    It is pointed, or blunt with slotted primaries spread like fingers.
    """
    x, y, z = wrist
    reach = half_span - x
    back = 0.2 * chord
    fingers = int(figures["fingers"])
    tip = figures["tip_chord"] * chord
    plan = POINTED_WING
    if fingers:
        plan = BLUNT_WING
    rows = []
    for along, chord_share in plan:
        # The leading edge sweeps back with the power 3/2 of the distance from the wrist.
        row_y = y - back * along * math.sqrt(along)
        row_chord = max(chord_share * chord, chord_share * tip)
        rows.append((x + along * reach, row_y, z, row_chord, 0.03))
    if not fingers:
        pointed_end = (half_span, y - 1.1 * back, z, min(0.5 * tip, 0.25 * chord), 0.03)
        return (foil([*rows, pointed_end], FEATHER_THICKNESS),)
    shells = [foil(rows, FEATHER_THICKNESS)]
    edge = rows[-1][1]
    width = 0.9 * chord / fingers
    for spread in np.linspace(0, 1, fingers):
        aside = 0.12 - 0.55 * spread
        start = np.array([x + 0.52 * reach, edge + aside * chord, z])
        end = np.array([half_span - 0.095 * spread * reach, start[1] + aside * tip, z])
        middle = (start + end) / 2
        primary = [(*start, width, 0.02), (*middle, width, 0.02), (*end, 0.4 * width, 0.02)]
        shells.append(foil(primary, FEATHER_THICKNESS))
    return tuple(shells)


def parts(record: dict) -> tuple[list[Part], dict]:
    """Return the parts of the bird that a merged record describes, and facts about its motion.

    The facts, `flap` and `wing_span_m`, are for the cloud's record.
    """
    figures = figures_si(record)
    length = record["published"]["size_m"]
    half_span = length * figures["span"] / figures["length"] / 2
    body_half = figures["body_width"] * length / 2
    forward = (0.5 - figures["bill"] - figures["head"] - figures["neck"] - 0.12) * length
    shoulder = np.array([0.55 * body_half, forward, 0.45 * body_half])
    chord = figures["wing_chord"] * half_span
    wrist = shoulder + np.array([figures["wrist"] * (half_span - shoulder[0]), 0.35 * chord, 0])
    inner_right = _inner(shoulder, wrist, chord)
    outer_right = _outer(wrist, half_span, chord, figures)
    result = [Part("body", "body", _body(length, figures))]
    for side, name in ((1, "right"), (-1, "left")):
        mirror = np.diag([float(side), 1.0, 1.0])
        root = (side * shoulder[0], shoulder[1], shoulder[2])
        inner = (inner_right.mapped(mirror),)
        outer = tuple(shell.mapped(mirror) for shell in outer_right)
        # The hinge's axis is -y on the right and +y on the left, so that a positive angle lifts the
        # tip.
        axis = (0.0, -float(side), 0.0)
        bend = (side * wrist[0], shoulder[1], shoulder[2])
        # The segments share the wing's points by their lengths.
        share = figures["wrist"]
        result.append(Part(f"{name} inner wing", "wing", inner, root, axis, weight=share))
        parent = len(result) - 1
        result.append(
            Part(f"{name} outer wing", "wing", outer, bend, axis, parent=parent, weight=1 - share)
        )
    facts = {"flap": FLAP | record.get("flap", {}), "wing_span_m": 2 * half_span}
    return result, facts
