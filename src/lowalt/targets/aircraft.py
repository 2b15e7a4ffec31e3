"""Built-in aircraft beyond multirotors: planes, planes with lift rotors in cruise, helicopters and balloons.

Axes: front +y, right +x, up +z, metres. The origin lies at the wing's quarter chord, under the rotor's hub at mid
cabin, or in the middle of the envelope. A plane's wing span, a helicopter's rotor diameter and a balloon's diameter are
the published size. What a layout needs is in FIGURES; where a number below is a plain factor it only rounds or joins
shells.
"""

import numpy as np

from lowalt.targets.assemble import Part
from lowalt.targets.surfaces import Surface, box, cylinder, ellipsoid, foil, hull, tube
from lowalt.targets.uav_pieces import blade, fuselage

_PROPELLER = {"propeller_diameter": "length", "blade_count": "count", "blade_chord": "length"}
_BODY = {"body_length": "length", "body_width": "length", "body_height": "length"}
_PLANE = _PROPELLER | _BODY | {
    "wing_station": "ratio", "wing_height": "offset", "root_chord": "length", "tip_chord": "length",
    "tail_span": "length", "tail_chord": "length", "fin_height": "length",
}  # fmt: skip
FIGURES = {
    "plane": _PLANE,
    "lift and cruise": _PLANE | {"boom_spacing": "length", "boom_length": "length", "lift_diameter": "length"},
    "helicopter": _BODY | {
        "blade_count": "count", "blade_chord": "length", "mast_height": "length", "boom_length": "length",
        "boom_diameter": "length", "tail_span": "length", "fin_height": "length", "skid_track": "length",
        "skid_height": "length",
    },
    "balloon": {
        "envelope_height": "length", "line_length": "length", "load_length": "length", "load_width": "length",
        "load_height": "length",
    },
}  # fmt: skip
"""The figures each layout needs. `wing_station` is where the quarter chord lies, in body lengths from the nose;
`wing_height` its height over the body's middle, in body heights."""

SIZES = {
    "plane": "wing span", "lift and cruise": "wing span", "helicopter": "rotor diameter",
    "balloon": "envelope diameter",
}  # fmt: skip
"""What the published size of each layout is."""

_ROTORS = {"plane": 1, "lift and cruise": 1, "helicopter": 1, "balloon": None}
_AHEAD = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""Turns the axis of a propeller from up to the front."""
_UPRIGHT = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
"""Turns a foil from the right to upwards."""
_LEFT = np.diag([-1.0, 1.0, 1.0])


def fault(record: dict) -> str | None:
    """Return what makes a merged record no aircraft of its layout, or None."""
    f = {name: value["si"] for name, value in record["figures"].items()}
    model, size, count = record["model"], record["published"]["size_m"], record["published"]["n_rotors_or_wings"]
    if record["size_is"] != SIZES[model]:
        return f"size_is is {record['size_is']!r}, expected {SIZES[model]!r} with model {model}"
    if count != _ROTORS[model]:
        return f"model is {model}, expected n_rotors_or_wings {_ROTORS[model]} in the table of targets, not {count}"
    if "tip_chord" in f and not f["tip_chord"] <= f["root_chord"] < f["body_length"]:
        return f"figures.root_chord is {f['root_chord']:.4g} m, expected from the tip's chord to the body's length"
    if "wing_station" in f and not 0 < f["wing_station"] < 1:
        return f"figures.wing_station is {f['wing_station']}, expected between 0 (nose) and 1 (tail)"
    if "boom_spacing" in f and f["boom_spacing"] >= size:
        return f"figures.boom_spacing is {f['boom_spacing']:.4g} m, expected less than the span of {size} m"
    if record["points"] <= f.get("blade_count", 0):
        return f"points is {record['points']}, expected more than one for each blade"
    return None


def _both(shell: Surface) -> list[Surface]:
    """A shell of the right side and its mirror image."""
    return [shell, shell.mapped(_LEFT)]


def _propeller(name: str, hub: tuple[float, float, float], diameter: float, f: dict, ahead: bool) -> Part:
    """A turning propeller with its axis up or to the front."""
    shell, axis = blade(diameter / 2, f["blade_chord"]), (0.0, 0.0, 1.0)
    if ahead:
        shell, axis = shell.mapped(_AHEAD), (0.0, 1.0, 0.0)
    return Part(name, "rotor", (shell.moved(hub),), hub, axis, copies=int(f["blade_count"]))


def _airframe(span: float, f: dict, booms: float = 0.0) -> list[Surface]:
    """Fuselage, wing, tail plane and fin; with `booms` (m) the tail stands between two booms that far apart."""
    nose = f["wing_station"] * f["body_length"]
    middle = nose - f["body_length"] / 2
    height = f["wing_height"] * f["body_height"]
    body = fuselage(f, 0.25).moved((0, middle, -height))
    root, tip = f["root_chord"], f["tip_chord"]
    wing = foil([(0, 0, 0, root, 0.02), (0.25 * span, 0, 0.01 * span, (root + tip) / 2 + 0.2 * (root - tip), 0.02),
                 (0.5 * span, 0, 0.02 * span, tip, 0.0)], 0.12)  # fmt: skip
    back = nose - f["body_length"] + 0.3 * f["tail_chord"]
    chord, thin = f["tail_chord"], 0.09
    level = -height if not booms else 0.0
    tail = foil([(0, back, level, chord, 0), (f["tail_span"] / 2, back, level, 0.7 * chord, 0)], thin)
    fin = foil([(0, back, 0, 1.1 * chord, 0), (f["fin_height"], back - 0.2 * chord, 0, 0.6 * chord, 0)], thin)
    upright = fin.mapped(_UPRIGHT).moved((booms / 2, 0, level))
    return [body, *_both(wing), *_both(tail), *(_both(upright) if booms else [upright])]


def plane(record: dict, f: dict) -> list[Part]:
    """Return a plane with a tractor propeller at the nose."""
    shells = _airframe(record["published"]["size_m"], f)
    hub = (0.0, f["wing_station"] * f["body_length"] + 0.02 * f["body_length"], -f["wing_height"] * f["body_height"])
    return [Part("body", "body", tuple(shells)), _propeller("propeller", hub, f["propeller_diameter"], f, ahead=True)]


def lift_and_cruise(record: dict, f: dict) -> list[Part]:
    """Return a plane in cruise: a pusher turns behind the body, four lift propellers stand still along two booms."""
    shells = _airframe(record["published"]["size_m"], f, f["boom_spacing"])
    x, reach, radius = f["boom_spacing"] / 2, f["boom_length"], 0.03 * f["boom_length"] / 2
    back = f["wing_station"] * f["body_length"] - f["body_length"]
    ahead = back + reach
    shells += _both(tube([(x, ahead, 0), (x, back, 0)], radius, 8))
    lift = f["lift_diameter"]
    for y in (ahead - 0.02 * reach, back + 0.25 * reach):
        top = 2.5 * radius
        shells += _both(cylinder(1.5 * radius, (x, y, 0), (x, y, top), 10))
        # A stopped lift propeller is held along its boom, where it resists least.
        shells += _both(box((0.08 * lift, lift, 0.012 * lift), (x, y, top)))
    hub = (0.0, back - 0.02 * f["body_length"] + 0.1 * f["tail_chord"], -f["wing_height"] * f["body_height"])
    return [Part("body", "body", tuple(shells)), _propeller("propeller", hub, f["propeller_diameter"], f, ahead=True)]


def helicopter(record: dict, f: dict) -> list[Part]:
    """Return a helicopter without a tail rotor: egg-shaped cabin, mast and main rotor, tail boom, two fins, skids."""
    long, half, high = f["body_length"], f["body_width"] / 2, f["body_height"]
    shape = ((0.5, 0.25, -0.25, 0.1), (0.4, 0.7, -0.42, 0.32), (0.15, 1, -0.5, 0.5), (-0.2, 0.95, -0.48, 0.5),
             (-0.42, 0.55, -0.2, 0.42), (-0.5, 0.35, 0.0, 0.36))  # fmt: skip
    cabin = hull([(y * long, w * half, a * high, b * high) for y, w, a, b in shape], 2.4, bow=0.03 * long)
    top, start = 0.5 * high + f["mast_height"], -0.4 * long
    end, level, wide = start - f["boom_length"], 0.2 * high, f["boom_diameter"] / 2
    shells = [cabin, cylinder(0.06 * half, (0, 0, 0.4 * high), (0, 0, top)),
              tube([(0, start, level), (0, end, level)], [wide, 0.7 * wide])]  # fmt: skip
    chord, reach = 0.45 * f["fin_height"], f["tail_span"] / 2
    shells += _both(foil([(0, end, level, chord, 0), (reach, end, level, chord, 0)], 0.1))
    fin = foil([(-f["fin_height"] / 2, end, 0, chord, 0), (f["fin_height"] / 2, end, 0, chord, 0)], 0.1)
    shells += _both(fin.mapped(_UPRIGHT).moved((reach, 0, level)))
    foot, low, thin = f["skid_track"] / 2, -0.5 * high - f["skid_height"], 0.03 * half
    shells += _both(tube([(foot, -0.45 * long, low), (foot, 0.4 * long, low)], 1.5 * thin, 8))
    for y in (-0.25 * long, 0.2 * long):
        shells += _both(tube([(0.4 * half, y, -0.4 * high), (foot, y, low)], thin, 8))
    hub = (0.0, 0.0, top)
    main = _propeller("main rotor", hub, record["published"]["size_m"], f, ahead=False)
    return [Part("body", "body", tuple(shells)), main]


def balloon(record: dict, f: dict) -> list[Part]:
    """Return a balloon: an envelope, a line and a box of instruments below it; nothing turns."""
    half, high = record["published"]["size_m"] / 2, f["envelope_height"] / 2
    end = -high - f["line_length"]
    load = box((f["load_width"], f["load_length"], f["load_height"]), (0, 0, end - f["load_height"] / 2))
    line = tube([(0, 0, -0.99 * high), (0, 0, end)], 0.004, 6)
    return [Part("body", "body", (ellipsoid((half, half, high), sides=24), line, load))]


LAYOUTS = {"plane": plane, "lift and cruise": lift_and_cruise, "helicopter": helicopter, "balloon": balloon}
