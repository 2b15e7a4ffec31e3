"""Built-in aircraft beyond multirotors: planes with or without lift, helicopters and balloons.

Axes: front +y, right +x, up +z, metres. The origin lies at the wing's quarter chord, under the
rotor's hub at mid cabin, or in the middle of the envelope. A plane's wing span, a helicopter's
rotor diameter and a balloon's diameter are the published size. `records.schema.yaml` lists the
figures of each layout: `wing_station` is where the quarter chord lies, in body lengths from the
nose; `wing_height` its height over the body's middle, in body heights; `tail_arm` and
`tail_rotor_arm` are how far tail plane and tail rotor lie behind the main rotor's hub,
`tail_rotor_drop` how far the tail rotor lies below it. Plain factors below only round or join
shells.
"""

import numpy as np

from lowalt.targets.assemble import Part
from lowalt.targets.record_schema import figures_si
from lowalt.targets.surfaces import Surface, box, cylinder, ellipsoid, foil, hull, tube
from lowalt.targets.uav_pieces import blade, fuselage

_UP = np.eye(3)
_AHEAD = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""Turns the axis of a propeller from up to the front."""
_UPRIGHT = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
"""Turns a foil from the right to upwards."""
_SIDEWAYS = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
"""Turns the axis of a propeller from up to the right."""
_LEFT = np.diag([-1.0, 1.0, 1.0])


def fault(record: dict) -> str | None:
    """Return the reason why a merged record is no aircraft of its layout, or None."""
    f = figures_si(record)
    if "tip_chord" in f and not f["tip_chord"] <= f["root_chord"] < f["body_length"]:
        return (
            f"figures.root_chord is {f['root_chord']:.4g} m, expected from the tip's chord to the "
            "body's length"
        )
    if "wing_station" in f and not 0 < f["wing_station"] < 1:
        return (
            f"figures.wing_station is {f['wing_station']}, expected between 0 (nose) and 1 (tail)"
        )
    if f.get("boom_spacing", 0) >= record["published"]["size_m"]:
        span = record["published"]["size_m"]
        return (
            f"figures.boom_spacing is {f['boom_spacing']:.4g} m, expected less than the span of "
            f"{span} m"
        )
    return None


def _both(shell: Surface) -> list[Surface]:
    """A shell of the right side and its mirror image."""
    return [shell, shell.mapped(_LEFT)]


def _propeller(
    name: str,
    hub: tuple[float, float, float],
    size: tuple[float, float, float],
    facing: np.ndarray,
    sense: int = 1,
) -> Part:
    """A turning propeller of a `size` (diameter m, blade's chord m, blades).

    Its axis is facing @ (0, 0, 1). Rotors share their points by the area of their blades.
    """
    diameter, chord, count = size
    x, y, z = (sense * facing[:, 2]).tolist()
    shells = (blade(diameter, chord, sense).mapped(facing).moved(hub),)
    area = diameter * chord * count
    return Part(name, "rotor", shells, hub, (x, y, z), copies=int(count), weight=area)


def _main_size(f: dict) -> tuple[float, float, float]:
    """Diameter, chord and blades of a plane's propeller."""
    return f["propeller_diameter"], f["blade_chord"], f["blade_count"]


def _airframe(span: float, f: dict, booms: float = 0.0) -> list[Surface]:
    """Fuselage, wing, tail plane and fin.

    With `booms` (m) the tail stands between two booms that far apart.
    """
    nose = f["wing_station"] * f["body_length"]
    middle = nose - f["body_length"] / 2
    height = f["wing_height"] * f["body_height"]
    body = fuselage(f, 0.25).moved((0, middle, -height))
    root = f["root_chord"]
    tip = f["tip_chord"]
    half_way = (root + tip) / 2 + 0.2 * (root - tip)
    # Position (x, y, z) of the quarter chord, chord, twist.
    stations = [
        (0, 0, 0, root, 0.02),
        (0.25 * span, 0, 0.01 * span, half_way, 0.02),
        (0.5 * span, 0, 0.02 * span, tip, 0.0),
    ]
    wing = foil(stations, 0.12)
    back = nose - f["body_length"] + 0.3 * f["tail_chord"]
    chord = f["tail_chord"]
    thin = 0.09
    level = 0.0
    if not booms:
        level = -height
    tail_root = (0, back, level, chord, 0)
    tail_tip = (f["tail_span"] / 2, back, level, 0.7 * chord, 0)
    tail = foil([tail_root, tail_tip], thin)
    fin_root = (0, back, 0, 1.1 * chord, 0)
    fin_tip = (f["fin_height"], back - 0.2 * chord, 0, 0.6 * chord, 0)
    fin = foil([fin_root, fin_tip], thin)
    fins = [fin.mapped(_UPRIGHT).moved((booms / 2, 0, level))]
    if booms:
        fins = _both(fins[0])
    return [body, *_both(wing), *_both(tail), *fins]


def plane(record: dict, f: dict) -> list[Part]:
    """Return a plane with a tractor propeller at the nose."""
    shells = _airframe(record["published"]["size_m"], f)
    nose = f["wing_station"] * f["body_length"]
    height = f["wing_height"] * f["body_height"]
    hub = (0.0, nose + 0.02 * f["body_length"], -height)
    return [
        Part("body", "body", tuple(shells)),
        _propeller("propeller", hub, _main_size(f), _AHEAD),
    ]


def lift_and_cruise(record: dict, f: dict) -> list[Part]:
    """Return a plane with a pusher behind its body and four lift propellers on two booms.

    With one rotor in the table of targets the lift propellers stand still along the booms; with
    five they turn.
    """
    turn = record["published"]["n_rotors_or_wings"] == 5
    shells = _airframe(record["published"]["size_m"], f, f["boom_spacing"])
    x = f["boom_spacing"] / 2
    reach = f["boom_length"]
    radius = 0.03 * f["boom_length"] / 2
    back = f["wing_station"] * f["body_length"] - f["body_length"]
    ahead = back + reach
    shells += _both(tube([(x, ahead, 0), (x, back, 0)], radius, 8))
    lift = f["lift_diameter"]
    chord = 0.08 * f["lift_diameter"]
    lifting = []
    front_y = ahead - 0.02 * reach
    rear_y = back + 0.25 * reach
    for sense, end, y in ((1, "front", front_y), (-1, "rear", rear_y)):
        top = 2.5 * radius
        shells += _both(cylinder(1.5 * radius, (x, y, 0), (x, y, top), 10))
        if turn:
            size = (lift, chord, f["blade_count"])
            lifting.append(_propeller(f"lift {end} right", (x, y, top), size, _UP, sense))
            lifting.append(_propeller(f"lift {end} left", (-x, y, top), size, _UP, -sense))
        else:
            # A stopped lift propeller is held along its boom, where it resists least.
            shells += _both(box((chord, lift, 0.012 * lift), (x, y, top)))
    height = f["wing_height"] * f["body_height"]
    hub = (0.0, back - 0.02 * f["body_length"] + 0.1 * f["tail_chord"], -height)
    return [
        Part("body", "body", tuple(shells)),
        _propeller("propeller", hub, _main_size(f), _AHEAD),
        *lifting,
    ]


def _cabin(f: dict) -> tuple[list[Surface], float, float]:
    """Egg-shaped cabin, mast and tail boom, the boom's end (m, to the front) and its height (m)."""
    long = f["body_length"]
    half = f["body_width"] / 2
    high = f["body_height"]
    # Position to the front, half width, lower and upper edge, as shares of the cabin's measures.
    shape = (
        (0.5, 0.25, -0.25, 0.1),
        (0.4, 0.7, -0.42, 0.32),
        (0.15, 1, -0.5, 0.5),
        (-0.2, 0.95, -0.48, 0.5),
        (-0.42, 0.55, -0.2, 0.42),
        (-0.5, 0.35, 0.0, 0.36),
    )
    stations = [(y * long, w * half, low * high, top * high) for y, w, low, top in shape]
    cabin = hull(stations, 2.4, bow=0.03 * long)
    top = 0.5 * high + f["mast_height"]
    start = -0.4 * long
    end = start - f["boom_length"]
    level = 0.2 * high
    wide = f["boom_diameter"] / 2
    mast = cylinder(0.06 * half, (0, 0, 0.4 * high), (0, 0, top))
    boom = tube([(0, start, level), (0, end, level)], [wide, 0.7 * wide])
    return [cabin, mast, boom], end, level


def _main_rotor(record: dict, f: dict) -> Part:
    """The main rotor on its mast."""
    hub = (0.0, 0.0, 0.5 * f["body_height"] + f["mast_height"])
    size = (record["published"]["size_m"], f["blade_chord"], f["blade_count"])
    return _propeller("main rotor", hub, size, _UP)


def helicopter(record: dict, f: dict) -> list[Part]:
    """Return a helicopter without a tail rotor: cabin, main rotor, tail boom, two fins, skids."""
    shells, end, level = _cabin(f)
    long = f["body_length"]
    half = f["body_width"] / 2
    high = f["body_height"]
    chord = 0.45 * f["fin_height"]
    reach = f["tail_span"] / 2
    tail_plane = foil([(0, end, level, chord, 0), (reach, end, level, chord, 0)], 0.1)
    shells += _both(tail_plane)
    half_fin = f["fin_height"] / 2
    fin = foil([(-half_fin, end, 0, chord, 0), (half_fin, end, 0, chord, 0)], 0.1)
    shells += _both(fin.mapped(_UPRIGHT).moved((reach, 0, level)))
    foot = f["skid_track"] / 2
    low = -0.5 * high - f["skid_height"]
    thin = 0.03 * half
    skid = [(foot, -0.45 * long, low), (foot, 0.4 * long, low)]
    shells += _both(tube(skid, 1.5 * thin, 8))
    for y in (-0.25 * long, 0.2 * long):
        shells += _both(tube([(0.4 * half, y, -0.4 * high), (foot, y, low)], thin, 8))
    return [Part("body", "body", tuple(shells)), _main_rotor(record, f)]


def tail_rotor(record: dict, f: dict) -> list[Part]:
    """Return a helicopter with a tail rotor, its wheels drawn in.

    Its body is cabin, tail boom, tail plane and fin.
    """
    shells, end, level = _cabin(f)
    main = _main_rotor(record, f)
    fin_height = f["fin_height"]
    chord = 0.35 * fin_height
    arm = -f["tail_arm"]
    half_span = f["tail_span"] / 2
    plane = foil([(0, arm, level, chord, 0), (half_span, arm, level, 0.8 * chord, 0)], 0.1)
    fin = foil(
        [
            (-0.4 * fin_height, end - 0.3 * chord, 0, 0.6 * chord, 0),
            (0, end, 0, 1.2 * chord, 0),
            (0.6 * fin_height, end - 0.5 * chord, 0, 0.7 * chord, 0),
        ],
        0.1,
    )
    _, _, main_height = main.hinge
    hub_y = -f["tail_rotor_arm"]
    hub_z = main_height - f["tail_rotor_drop"]
    hub = (-0.6 * f["boom_diameter"], hub_y, hub_z)
    shells += [*_both(plane), fin.mapped(_UPRIGHT).moved((0, 0, level))]
    # The shaft from the fin to the tail rotor.
    shells.append(cylinder(0.1 * f["boom_diameter"], (0, hub_y, hub_z), hub, 8))
    size = (f["tail_rotor_diameter"], f["tail_blade_chord"], f["tail_blade_count"])
    return [
        Part("body", "body", tuple(shells)),
        main,
        _propeller("tail rotor", hub, size, _SIDEWAYS),
    ]


def balloon(record: dict, f: dict) -> list[Part]:
    """Return a balloon: an envelope, a line and a box of instruments below it; nothing turns."""
    half = record["published"]["size_m"] / 2
    high = f["envelope_height"] / 2
    end = -high - f["line_length"]
    size = (f["load_width"], f["load_length"], f["load_height"])
    load = box(size, (0, 0, end - f["load_height"] / 2))
    line = tube([(0, 0, -0.99 * high), (0, 0, end)], 0.004, 6)
    return [Part("body", "body", (ellipsoid((half, half, high), sides=24), line, load))]


LAYOUTS = {
    "plane": plane,
    "lift and cruise": lift_and_cruise,
    "helicopter": helicopter,
    "tail rotor": tail_rotor,
    "balloon": balloon,
}
