"""Built-in bird models: body with head, bill and tail, and two wings of two hinged segments each.

Axes: front +y, right +x, up +z, metres; the origin lies half-way between bill tip and tail tip, wings flat.
A positive angle about either hinge raises the wing's tip, on both sides.
"""

import numpy as np

from lowalt.targets.assemble import Part
from lowalt.targets.surfaces import Surface, ellipsoid, foil, hull, loft, merged, superellipse, tube

FIGURES = {
    "bird": {
        "length": "length", "span": "length", "bill": "ratio", "bill_depth": "ratio", "head": "ratio", "neck": "offset",
        "body_width": "ratio", "tail": "ratio", "tail_spread": "ratio", "wing_chord": "ratio", "wrist": "ratio",
        "tip_chord": "ratio", "fingers": "whole",
    }
}  # fmt: skip
"""Figures of a bird. `length` (bill tip to tail tip) and `span` are the living bird's, of which only the ratio is
used: the published size sets the length. All ratios are to the length, but `wing_chord` (to half the span), `wrist`
(where along half the span the second hinge lies) and `tip_chord` (tip to root chord). `fingers` counts the slotted
primaries at the tip."""

FLAP = {"mean_deg": 15.0, "amplitude_deg": 40.0, "fold_amplitude_deg": 30.0, "fold_lag_deg": 90.0}
"""Default wing beat: shoulder mean + amplitude cos(2 pi F t), outer segment fold_amplitude cos(2 pi F t - fold_lag)."""

MOVING_SHARE = 0.62


def _body(length: float, f: dict) -> tuple[Surface, ...]:
    """Bill, head, neck and trunk, tail fan: bill tip at +length/2, tail tip at -length/2."""
    front = length / 2
    bill, head, neck, tail = (f[name] * length for name in ("bill", "head", "neck", "tail"))
    half = f["body_width"] * length / 2
    depth = f["bill_depth"] * length / 2
    skull_y = front - bill - 0.45 * head
    beak = loft(
        np.array(
            [
                np.stack([loop[:, 0], np.full(12, y), loop[:, 1] + droop], 1)
                for y, size, droop in (
                    (front - bill - 0.2 * head, 1.0, 0.0), (front - 0.6 * bill, 0.85, 0.0),
                    (front - 0.15 * bill, 0.45, -0.25 * depth),
                )
                for loop in [superellipse(0.6 * size * depth, size * depth, 2.0, 12)]
            ]
        ),
        tips=np.array([[0, front - bill - 0.2 * head, 0], [0, front, -0.4 * depth]]),
    )  # fmt: skip
    skull = ellipsoid((0.42 * head, 0.55 * head, 0.45 * head), (0, skull_y, 0))
    shoulder = skull_y - neck - 0.25 * head
    root = -front + tail
    trunk_length = shoulder - root
    trunk = hull(
        [(shoulder - t * trunk_length, w * half, -w * half * 0.95, w * half * 0.85)
         for t, w in ((-0.04, 0.3), (0.05, 0.62), (0.2, 0.92), (0.4, 1.0), (0.65, 0.85), (0.85, 0.55), (1.0, 0.3))],
        exponent=2.0,
    )  # fmt: skip
    throat = tube([(0, skull_y, 0), (0, shoulder - 0.12 * trunk_length, 0)], [0.36 * head, 0.6 * half + 0.1 * head])
    fan_half = f["tail_spread"] * length / 2
    thin = 0.03 * length
    fan = hull(
        [(root + 0.3 * tail, 0.28 * half, -thin, thin), (root - 0.3 * tail, 0.5 * fan_half, -0.4 * thin, 0.4 * thin),
         (-front + 0.06 * tail, fan_half, -0.15 * thin, 0.15 * thin), (-front, 0.86 * fan_half, -0.1 * thin, 0.1 * thin)],
        exponent=3.0,
    )  # fmt: skip
    return beak, skull, throat, trunk, fan


def _wing(shoulder: np.ndarray, half_span: float, f: dict) -> tuple[Surface, Surface, float]:
    """Inner and outer segment of the right wing along +x, and the wrist's x (m), in body axes."""
    reach = half_span - shoulder[0]
    chord = f["wing_chord"] * half_span
    wrist = shoulder[0] + f["wrist"] * reach
    advance = 0.35 * chord
    x0, y0, z0 = shoulder
    inner = foil(
        [(x0 - 0.02 * reach, y0, z0, chord, 0.05), (x0 + 0.5 * (wrist - x0), y0 + 0.6 * advance, z0, 0.98 * chord, 0.05),
         (wrist, y0 + advance, z0, 0.95 * chord, 0.04)],
        0.11,
    )  # fmt: skip
    tip = f["tip_chord"] * chord
    outer_reach = half_span - wrist
    y1 = y0 + advance
    fingers = int(f["fingers"])
    end = 0.62 if fingers else 1.0
    stations = [(0, 1.0), (0.35, 0.92), (0.62, 0.8)] if fingers else [(0, 1.0), (0.35, 0.85), (0.7, 0.6), (0.92, 0.3)]
    rows = [
        (wrist + t * outer_reach, y1 - 0.5 * advance * t**1.5, z0, max(c * 0.95 * chord, tip * c), 0.03)
        for t, c in stations
    ]
    if not fingers:
        rows.append((half_span, y1 - 0.75 * advance, z0, 0.5 * tip, 0.03))
    shells = [foil(rows, 0.06)]
    for k in range(fingers):
        spread = k / max(fingers - 1, 1)
        start_y = rows[-1][1] + 0.12 * chord - spread * 0.55 * chord
        tip_x = half_span - 0.25 * spread * (1 - end) * outer_reach
        tip_y = start_y + (0.12 - 0.55 * spread) * chord
        width = 0.9 * chord / fingers
        base = wrist + (end - 0.1) * outer_reach
        shells.append(foil([(base, start_y, z0, width, 0.02), (0.5 * (base + tip_x), 0.5 * (start_y + tip_y), z0, width,
                             0.02), (tip_x, tip_y, z0, 0.4 * width, 0.02)], 0.06))  # fmt: skip
    return inner, merged(shells) if len(shells) == 1 else tuple(shells), wrist


def parts(record: dict) -> tuple[list[Part], dict]:
    """Return the parts of the bird a merged record describes, and the facts its cloud's record adds (flap, sizes)."""
    f = {name: value["si"] for name, value in record["figures"].items()}
    length = record["published"]["size_m"]
    half_span = length * f["span"] / f["length"] / 2
    body_half = f["body_width"] * length / 2
    forward = length / 2 - (f["bill"] + f["head"] + f["neck"]) * length - 0.12 * length
    shoulder = np.array([0.55 * body_half, forward, 0.45 * body_half])
    inner, outer, wrist = _wing(shoulder, half_span, f)
    outer = outer if isinstance(outer, tuple) else (outer,)
    mirror = np.diag([-1.0, 1.0, 1.0])
    result = [Part("body", "body", _body(length, f))]
    for side, name in ((1, "right"), (-1, "left")):
        place = mirror if side < 0 else np.eye(3)
        hinge = tuple(place @ shoulder)
        bend = tuple(place @ np.array([wrist, shoulder[1], shoulder[2]]))
        axis = (0.0, -float(side), 0.0)
        result.append(Part(f"{name} inner wing", "wing", (inner.mapped(place),), hinge, axis, weight=f["wrist"]))
        result.append(
            Part(f"{name} outer wing", "wing", tuple(shell.mapped(place) for shell in outer), bend, axis,
                 parent=len(result) - 1, weight=1 - f["wrist"])
        )  # fmt: skip
    return result, {"flap": FLAP | record.get("flap", {}), "wing_span_m": 2 * half_span}
