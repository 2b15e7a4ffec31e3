"""Built-in aircraft beyond multirotors: planes with or without lift, helicopters and balloons.

Axes: front +y, right +x, up +z, metres. The origin lies at the wing's quarter chord, under the
rotor's hub at mid cabin, or in the middle of the envelope. A plane's wing span, a helicopter's
rotor diameter and a balloon's diameter are the published size. `records.schema.yaml` lists the
figures of each layout: `wing_station` is where the quarter chord lies, in body lengths from the
nose; `wing_height` its height over the body's middle, in body heights; `tail_arm` and
`tail_rotor_arm` are how far tail plane and tail rotor lie behind the main rotor's hub,
`tail_rotor_drop` how far the tail rotor lies below it. The factors in the code are estimates of
usual proportions, as shares of the figures.
"""

import numpy as np

from lowalt.targets.assemble import Part
from lowalt.targets.record_schema import figures_si
from lowalt.targets.surfaces import Surface, box, cylinder, ellipsoid, foil, tube
from lowalt.targets.uav_pieces import STRUT_SIDES, blade, fuselage, shaped, strut

_UP = np.eye(3)
_AHEAD = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""Turns the axis of a propeller from up to the front."""
_UPRIGHT = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
"""Turns a foil from the right to upwards."""
_SIDEWAYS = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
"""Turns the axis of a propeller from up to the right."""
_LEFT = np.diag([-1.0, 1.0, 1.0])
"""Mirrors the right side to the left."""

CABIN = (
    (0.5, 0.25, -0.25, 0.1),
    (0.4, 0.7, -0.42, 0.32),
    (0.15, 1, -0.5, 0.5),
    (-0.2, 0.95, -0.48, 0.5),
    (-0.42, 0.55, -0.2, 0.42),
    (-0.5, 0.35, 0.0, 0.36),
)
"""The egg-shaped cabin of a helicopter, as rows of `uav_pieces.shaped`; estimate."""
TAIL_THICKNESS = 0.1
"""Largest thickness of a helicopter's tail plane and fins over their chord; estimate."""


LINE_RADIUS_M = 0.004
"""Radius of a balloon's line; estimate."""


def fault(record: dict) -> str | None:
    """Return the reason why a merged record is no aircraft of its layout, or None."""
    figures = figures_si(record)
    if (
        "tip_chord" in figures
        and not figures["tip_chord"] <= figures["root_chord"] < figures["body_length"]
    ):
        return (
            f"figures.root_chord is {figures['root_chord']:.4g} m, expected from the tip's chord to"
            " the body's length"
        )
    if "wing_station" in figures and not 0 < figures["wing_station"] < 1:
        return (
            f"figures.wing_station is {figures['wing_station']}, expected between 0 (nose) and 1"
            " (tail)"
        )
    if figures.get("boom_spacing", 0) >= record["published"]["size_m"]:
        span = record["published"]["size_m"]
        return (
            f"figures.boom_spacing is {figures['boom_spacing']:.4g} m, expected less than the span"
            f" of {span} m"
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


def _main_size(figures: dict) -> tuple[float, float, float]:
    """Diameter, chord and blades of a plane's propeller."""
    return figures["propeller_diameter"], figures["blade_chord"], figures["blade_count"]


def _airframe(span: float, figures: dict, booms: float = 0.0) -> list[Surface]:
    """Return the shells of fuselage, wing, tail plane and fin.

    booms: distance (m) of two booms between which the tail stands; 0 where the body carries it.
    """
    nose = figures["wing_station"] * figures["body_length"]
    middle = nose - figures["body_length"] / 2
    height = figures["wing_height"] * figures["body_height"]
    body = fuselage(figures, taper=0.25).moved((0, middle, -height))
    root = figures["root_chord"]
    tip = figures["tip_chord"]
    half_way = (root + tip) / 2 + 0.2 * (root - tip)
    # Position (x, y, z) of the quarter chord (m), chord (m), twist (rad).
    stations = [
        (0, 0, 0, root, 0.02),
        (0.25 * span, 0, 0.01 * span, half_way, 0.02),
        (0.5 * span, 0, 0.02 * span, tip, 0.0),
    ]
    wing = foil(stations, thickness=0.12)
    back = nose - figures["body_length"] + 0.3 * figures["tail_chord"]
    chord = figures["tail_chord"]
    tail_thickness = 0.09
    level = 0.0
    if not booms:
        level = -height
    tail_root = (0, back, level, chord, 0)
    tail_tip = (figures["tail_span"] / 2, back, level, 0.7 * chord, 0)
    tail = foil([tail_root, tail_tip], tail_thickness)
    fin_root = (0, back, 0, 1.1 * chord, 0)
    fin_tip = (figures["fin_height"], back - 0.2 * chord, 0, 0.6 * chord, 0)
    fin = foil([fin_root, fin_tip], tail_thickness)
    fins = [fin.mapped(_UPRIGHT).moved((booms / 2, 0, level))]
    if booms:
        fins = _both(fins[0])
    return [body, *_both(wing), *_both(tail), *fins]


def plane(record: dict, figures: dict) -> list[Part]:
    """Return a plane with a tractor propeller at the nose."""
    shells = _airframe(record["published"]["size_m"], figures)
    nose = figures["wing_station"] * figures["body_length"]
    height = figures["wing_height"] * figures["body_height"]
    hub = (0.0, nose + 0.02 * figures["body_length"], -height)
    return [
        Part("body", "body", tuple(shells)),
        _propeller("propeller", hub, _main_size(figures), _AHEAD),
    ]


def lift_and_cruise(record: dict, figures: dict) -> list[Part]:
    """Return a plane with a pusher behind its body and four lift propellers on two booms.

    With one rotor in the table of targets the lift propellers stand still along the booms; with
    five they turn.
    """
    lift_propellers_turn = record["published"]["n_rotors_or_wings"] == 5
    shells = _airframe(record["published"]["size_m"], figures, figures["boom_spacing"])
    x = figures["boom_spacing"] / 2
    reach = figures["boom_length"]
    radius = 0.03 * figures["boom_length"] / 2
    back = figures["wing_station"] * figures["body_length"] - figures["body_length"]
    ahead = back + reach
    shells += _both(strut([(x, ahead, 0), (x, back, 0)], radius))
    lift_diameter = figures["lift_diameter"]
    chord = 0.08 * lift_diameter
    lift_propellers = []
    front_y = ahead - 0.02 * reach
    rear_y = back + 0.25 * reach
    for sense, end, y in ((1, "front", front_y), (-1, "rear", rear_y)):
        top = 2.5 * radius
        shells += _both(cylinder(1.5 * radius, (x, y, 0), (x, y, top), 10))
        if lift_propellers_turn:
            size = (lift_diameter, chord, figures["blade_count"])
            lift_propellers.append(_propeller(f"lift {end} right", (x, y, top), size, _UP, sense))
            lift_propellers.append(_propeller(f"lift {end} left", (-x, y, top), size, _UP, -sense))
        else:
            # A stopped lift propeller is held along its boom, where it resists least.
            shells += _both(box((chord, lift_diameter, 0.012 * lift_diameter), (x, y, top)))
    height = figures["wing_height"] * figures["body_height"]
    hub = (0.0, back - 0.02 * figures["body_length"] + 0.1 * figures["tail_chord"], -height)
    return [
        Part("body", "body", tuple(shells)),
        _propeller("propeller", hub, _main_size(figures), _AHEAD),
        *lift_propellers,
    ]


def _cabin(figures: dict) -> tuple[list[Surface], float, float]:
    """Return the shells of cabin, mast and tail boom, and the boom's end (y, m) and height (m)."""
    length = figures["body_length"]
    half_width = figures["body_width"] / 2
    height = figures["body_height"]
    bow = 0.03 * length
    cabin = shaped(CABIN, length, figures["body_width"], height, exponent=2.4, bow=bow)
    top = 0.5 * height + figures["mast_height"]
    start = -0.4 * length
    end = start - figures["boom_length"]
    level = 0.2 * height
    boom_radius = figures["boom_diameter"] / 2
    mast = cylinder(0.06 * half_width, (0, 0, 0.4 * height), (0, 0, top))
    boom = tube([(0, start, level), (0, end, level)], [boom_radius, 0.7 * boom_radius])
    return [cabin, mast, boom], end, level


def _main_rotor(record: dict, figures: dict) -> Part:
    """The main rotor on its mast."""
    hub = (0.0, 0.0, 0.5 * figures["body_height"] + figures["mast_height"])
    size = (record["published"]["size_m"], figures["blade_chord"], figures["blade_count"])
    return _propeller("main rotor", hub, size, _UP)


def helicopter(record: dict, figures: dict) -> list[Part]:
    """Return a helicopter without a tail rotor: cabin, main rotor, tail boom, two fins, skids."""
    shells, end, level = _cabin(figures)
    length = figures["body_length"]
    half_width = figures["body_width"] / 2
    height = figures["body_height"]
    chord = 0.45 * figures["fin_height"]
    reach = figures["tail_span"] / 2
    tail_root = (0, end, level, chord, 0)
    tail_tip = (reach, end, level, chord, 0)
    tail_plane = foil([tail_root, tail_tip], TAIL_THICKNESS)
    shells += _both(tail_plane)
    half_fin = figures["fin_height"] / 2
    # A fin is made along x; the map turns it upright.
    fin_bottom = (-half_fin, end, 0, chord, 0)
    fin_top = (half_fin, end, 0, chord, 0)
    fin = foil([fin_bottom, fin_top], TAIL_THICKNESS)
    shells += _both(fin.mapped(_UPRIGHT).moved((reach, 0, level)))
    foot = figures["skid_track"] / 2
    low = -0.5 * height - figures["skid_height"]
    radius = 0.03 * half_width
    skid = [(foot, -0.45 * length, low), (foot, 0.4 * length, low)]
    shells += _both(strut(skid, 1.5 * radius))
    for y in (-0.25 * length, 0.2 * length):
        root = (0.4 * half_width, y, -0.4 * height)
        shells += _both(strut([root, (foot, y, low)], radius))
    return [Part("body", "body", tuple(shells)), _main_rotor(record, figures)]


def tail_rotor(record: dict, figures: dict) -> list[Part]:
    """Return a helicopter with a tail rotor, its wheels drawn in.

    Its body is cabin, tail boom, tail plane and fin.
    """
    shells, end, level = _cabin(figures)
    main = _main_rotor(record, figures)
    fin_height = figures["fin_height"]
    chord = 0.35 * fin_height
    tail_y = -figures["tail_arm"]
    half_span = figures["tail_span"] / 2
    tail_root = (0, tail_y, level, chord, 0)
    tail_tip = (half_span, tail_y, level, 0.8 * chord, 0)
    tail_plane = foil([tail_root, tail_tip], TAIL_THICKNESS)
    fin_stations = [
        (-0.4 * fin_height, end - 0.3 * chord, 0, 0.6 * chord, 0),
        (0, end, 0, 1.2 * chord, 0),
        (0.6 * fin_height, end - 0.5 * chord, 0, 0.7 * chord, 0),
    ]
    fin = foil(fin_stations, TAIL_THICKNESS)
    _, _, main_height = main.hinge
    hub_y = -figures["tail_rotor_arm"]
    hub_z = main_height - figures["tail_rotor_drop"]
    hub = (-0.6 * figures["boom_diameter"], hub_y, hub_z)
    shells += [*_both(tail_plane), fin.mapped(_UPRIGHT).moved((0, 0, level))]
    # The shaft from the fin to the tail rotor.
    shells.append(cylinder(0.1 * figures["boom_diameter"], (0, hub_y, hub_z), hub, STRUT_SIDES))
    size = (
        figures["tail_rotor_diameter"],
        figures["tail_blade_chord"],
        figures["tail_blade_count"],
    )
    return [
        Part("body", "body", tuple(shells)),
        main,
        _propeller("tail rotor", hub, size, _SIDEWAYS),
    ]


def balloon(record: dict, figures: dict) -> list[Part]:
    """Return a balloon: an envelope, a line and a box of instruments below it; nothing turns."""
    half_width = record["published"]["size_m"] / 2
    half_height = figures["envelope_height"] / 2
    envelope = ellipsoid((half_width, half_width, half_height), sides=24)
    end = -half_height - figures["line_length"]
    size = (figures["load_width"], figures["load_length"], figures["load_height"])
    load = box(size, (0, 0, end - figures["load_height"] / 2))
    # The line begins inside the envelope, so that the shells join.
    line = tube([(0, 0, -0.99 * half_height), (0, 0, end)], LINE_RADIUS_M, sides=6)
    return [Part("body", "body", (envelope, line, load))]


LAYOUTS = {
    "plane": plane,
    "lift and cruise": lift_and_cruise,
    "helicopter": helicopter,
    "tail rotor": tail_rotor,
    "balloon": balloon,
}
