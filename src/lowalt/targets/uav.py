"""Built-in multirotor models: frame, motors, ducts, legs, payload and turning propellers as closed shells.

Axes: front +y, right +x, up +z, metres; the origin lies in the middle of the rotor plane's plan, at mid body.
What a layout needs is in FIGURES; where a number below is a plain factor it only rounds or joins shells.
"""

import numpy as np

from lowalt.targets.assemble import Part
from lowalt.targets.surfaces import Surface, box, cylinder, ellipsoid, foil, hull, ring, tube

SIZES = ("motor diagonal", "span over ducts", "span over rotors")
"""What the published size may stand for: largest distance between motor axes, or that over the ducts or blade tips."""

_COMMON = {
    "propeller_diameter": "length", "blade_count": "count", "blade_chord": "length",
    "body_length": "length", "body_width": "length", "body_height": "length",
    "motor_diameter": "length", "motor_height": "length", "arm_diameter": "length", "leg_height": "length",
}  # fmt: skip
_QUAD = _COMMON | {"spacing_ratio": "ratio"}
FIGURES = {
    "folding": _QUAD | {"camera_diameter": "length"},
    "ducted": _QUAD | {"motor_diagonal": "length", "duct_height": "length", "camera_diameter": "length"},
    "raised": _QUAD | {"camera_diameter": "length", "frame_rise": "length"},
    "radial": _COMMON | {"camera_diameter": "length", "battery_length": "length"},
    "cabin": _COMMON | {"coaxial_gap": "length"},
    "tanker": _QUAD | {"tank_diameter": "length", "tank_length": "length", "lance_length": "length"},
}
"""The figures each layout needs and what each is: a length (m), a count or a ratio."""

MOVING_SHARE = 0.4


def motor_diagonal(record: dict) -> float:
    """Return the largest distance between motor axes (m) that gives the craft its published size."""
    size, figure = record["published"]["size_m"], record["figures"]
    if record["size_is"] == "span over ducts":
        return figure["motor_diagonal"]["si"]
    if record["size_is"] == "span over rotors":
        return size - figure["propeller_diameter"]["si"]
    return size


def hubs(record: dict, ratio: float | None) -> np.ndarray:
    """Return the motor axes' places (R, 2) in plan (m), counted anticlockwise seen from above.

    With a `ratio` (lateral over longitudinal spacing) four at the corners of a rectangle, else evenly on a circle
    with the front between two of them.
    """
    reach = motor_diagonal(record) / 2
    count = record["published"]["n_rotors_or_wings"]
    if ratio is not None:
        half = np.arctan(ratio)
        angle = np.pi / 2 + np.array([-half, half, np.pi - half, np.pi + half])
    else:
        angle = np.pi / 2 + 2 * np.pi * (np.arange(count) - 0.5) / count
    return reach * np.stack([np.cos(angle), np.sin(angle)], 1)


def blade(radius: float, chord: float, root: float = 0.08) -> Surface:
    """Return one propeller blade along +x for a rotor turning anticlockwise (leading edge at +y), hub at the origin.

    Twist follows a constant pitch of two thirds of the diameter, chord is largest at 0.35 of the radius.
    """
    stations = np.array([root, 0.2, 0.35, 0.55, 0.75, 0.92, 1.0])
    chords = chord * np.array([0.55, 0.85, 1.0, 0.88, 0.68, 0.5, 0.25])
    twist = np.arctan(4 / 3 / (2 * np.pi * np.maximum(stations, 0.2)))
    return foil([(x * radius, 0, 0, c, t) for x, c, t in zip(stations, chords, twist, strict=True)], 0.10)


def rotor(name: str, hub: np.ndarray, sense: int, figure: dict) -> Part:
    """Return the rotor part about `hub` (3,): equal blades, axis `sense` times up, first blade square to its arm."""
    shell = blade(figure["propeller_diameter"] / 2, figure["blade_chord"])
    if sense < 0:
        shell = shell.mapped(np.diag([1.0, -1.0, 1.0]))
    out = np.arctan2(hub[1], hub[0]) + np.pi / 2
    turn = np.array([[np.cos(out), -np.sin(out), 0], [np.sin(out), np.cos(out), 0], [0, 0, 1]])
    axis = (0.0, 0.0, float(sense))
    return Part(name, "rotor", (shell.mapped(turn).moved(hub),), tuple(hub), axis, copies=int(figure["blade_count"]))


def rotors(places: np.ndarray, height: float, figure: dict, gap: float = 0.0) -> list[Part]:
    """Return the rotors on the motor axes (R, 2) at `height`; neighbours turn in opposite senses.

    With a `gap` (m) each axis carries a coaxial pair, the lower one turning against the upper.
    """
    parts = []
    for index, (x, y) in enumerate(places):
        sense = 1 if index % 2 == 0 else -1
        parts.append(rotor(f"rotor {index + 1}", np.array([x, y, height]), sense, figure))
        if gap:
            parts.append(rotor(f"rotor {index + 1} lower", np.array([x, y, height - gap]), -sense, figure))
    return parts


def motors(places: np.ndarray, top: float, figure: dict) -> list[Surface]:
    """Return the motor cans under the rotors (R, 2), reaching up to `top`."""
    low, radius = top - figure["motor_height"], figure["motor_diameter"] / 2
    return [cylinder(radius, (x, y, low), (x, y, top)) for x, y in places]


def fuselage(figure: dict, taper: float = 0.55) -> Surface:
    """Return a slender fuselage along y, blunt at the nose and tapering to the tail."""
    length, width, height = figure["body_length"], figure["body_width"], figure["body_height"]
    stations = [(0.5, 0.62, -0.25, 0.28), (0.42, 0.85, -0.42, 0.42), (0.1, 1, -0.5, 0.5), (-0.3, 0.95, -0.5, 0.46),
                (-0.5, taper, -0.3, 0.3)]  # fmt: skip
    return hull([(y * length, w * width / 2, a * height, b * height) for y, w, a, b in stations], exponent=3.2)


def camera(figure: dict, y: float, z: float) -> list[Surface]:
    """Return a gimbal: a ball with its lens, hung from a short bar at (0, y, z)."""
    d = figure["camera_diameter"]
    lens = cylinder(d * 0.28, (0, y + 0.3 * d, z), (0, y + 0.62 * d, z))
    return [ellipsoid((d / 2, d / 2, d / 2), (0, y, z)), lens, cylinder(d * 0.12, (0, y, z), (0, y, z + 0.9 * d), 8)]


def folding(record: dict, f: dict) -> list[Part]:
    """Return a folding camera quadrotor: fuselage, swung-out arms, front legs, nose gimbal."""
    places, top = hubs(record, f["spacing_ratio"]), 0.5 * f["body_height"]
    shells = [fuselage(f), *motors(places, top, f), *camera(f, 0.44 * f["body_length"], -0.42 * f["body_height"])]
    arm = f["arm_diameter"] / 2
    for x, y in places:
        front = y > 0
        root = (0.3 * np.sign(x) * f["body_width"], (0.3 if front else -0.34) * f["body_length"])
        low = top - f["motor_height"]
        rise = (0.15 if front else -0.3) * f["body_height"]
        shells.append(tube([(*root, rise), (x, y, low)], [1.25 * arm, 0.9 * arm]))
        leg = f["leg_height"] if front else 0.35 * f["leg_height"]
        shells.append(tube([(x, y, low), (x * 1.02, y, low - leg)], [0.7 * arm, 0.35 * arm], 8))
    return [Part("body", "body", tuple(shells)), *rotors(places, top, f)]


def ducted(record: dict, f: dict) -> list[Part]:
    """Return a ducted quadrotor: four rings around the propellers, a narrow pod, a battery and a nose camera."""
    places = hubs(record, f["spacing_ratio"])
    outer = (record["published"]["size_m"] - motor_diagonal(record)) / 2
    inner, half = f["propeller_diameter"] / 2 * 1.04, f["duct_height"] / 2
    middle, wall = (inner + outer) / 2, (outer - inner) / 2
    turn = 2 * np.pi * np.arange(10) / 10
    duct = ring(np.stack([middle + wall * np.cos(turn), half * np.sin(turn)], 1), 40)
    shells = [duct.moved((x, y, 0)) for x, y in places] + motors(places, 0.0, f)
    for x, y in places:
        low = -f["motor_height"] - f["arm_diameter"] / 2
        for angle in np.pi / 2 + np.arange(3) * 2 * np.pi / 3:
            end = (x + middle * np.cos(angle), y + middle * np.sin(angle), low)
            shells.append(tube([(x, y, low), end], f["arm_diameter"] / 2, 8))
    pod = fuselage(f, 0.8).moved((0, 0, f["body_height"] / 2))
    battery = box((0.75 * f["body_width"], 0.45 * f["body_length"], 0.45 * f["body_height"]),
                  (0, -0.22 * f["body_length"], f["body_height"]))  # fmt: skip
    shells += [pod, battery, *camera(f, 0.52 * f["body_length"], 0.45 * f["body_height"])]
    for x in (-1, 1):
        for y in (-1, 1):
            top = (0.4 * x * f["body_width"], 0.25 * y * f["body_length"], 0)
            shells.append(tube([top, (top[0], top[1], -half - f["leg_height"])], f["arm_diameter"] / 2, 8))
    return [Part("body", "body", tuple(shells)), *rotors(places, 0.15 * half, f)]


def raised(record: dict, f: dict) -> list[Part]:
    """Return an H-frame craft in flight: side booms raised over the pod on a cross tube, big gimbal below the nose."""
    places = hubs(record, f["spacing_ratio"])
    boom, arm = f["frame_rise"], f["arm_diameter"] / 2
    reach_x, reach_y = abs(places).max(0)
    shells = [fuselage(f, 0.7), *motors(places, boom + arm + f["motor_height"], f)]
    for side in (-1, 1):
        x = side * reach_x
        shells.append(tube([(x, -1.08 * reach_y, boom), (x, 1.08 * reach_y, boom)], arm))
        shells.append(tube([(0.2 * side * f["body_width"], 0, 0.1 * f["body_height"]), (x, 0, boom)], [1.3 * arm, arm]))
        for end in (-1, 1):
            y = end * reach_y
            shells.append(tube([(x, y, boom), (1.04 * x, y, boom - f["leg_height"])], [0.7 * arm, 0.4 * arm], 8))
    d = f["camera_diameter"]
    shells += camera(f, 0.38 * f["body_length"], -0.5 * f["body_height"] - 0.6 * d)
    battery = box((0.55 * f["body_width"], 0.3 * f["body_length"], 0.4 * f["body_height"]),
                  (0, -0.3 * f["body_length"], 0.5 * f["body_height"]))  # fmt: skip
    return [Part("body", "body", (*shells, battery)), *rotors(places, boom + arm + 1.2 * f["motor_height"], f)]


def skids(half_track: float, length: float, top: float, bottom: float, radius: float) -> list[Surface]:
    """Return two landing skids: inclined struts from the body to runners along y."""
    shells = []
    for side in (-1, 1):
        foot = side * half_track
        shells.append(tube([(foot, -length / 2, bottom + radius), (foot, length / 2, bottom + radius)], radius, 8))
        for y in (-0.28 * length, 0.28 * length):
            shells.append(tube([(0.4 * foot, 0.7 * y, top), (foot, y, bottom + radius)], radius, 8))
    return shells


def radial(record: dict, f: dict) -> list[Part]:
    """Return a radial multirotor: round centre with its ring of batteries, straight arms, two skids, gimbal."""
    places, arm = hubs(record, None), f["arm_diameter"] / 2
    centre = hull([(y * f["body_length"], w * f["body_width"] / 2, -h * f["body_height"], h * f["body_height"])
                   for y, w, h in ((0.5, 0.25, 0.3), (0.42, 0.6, 0.42), (0.2, 0.95, 0.5), (-0.2, 0.95, 0.5),
                                   (-0.42, 0.6, 0.42), (-0.5, 0.25, 0.3))])  # fmt: skip
    top = arm + f["motor_height"]
    shells = [centre, *motors(places, top, f)]
    cell = f["battery_length"]
    for x, y in places:
        shells.append(tube([(0.2 * x, 0.2 * y, 0), (x, y, 0)], arm))
        turn = np.arctan2(y, x) - np.pi / 2
        spin = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        reach = 0.36 * f["body_length"]
        pack = box((0.4 * cell, cell, 0.5 * cell), (0, reach, 0.5 * f["body_height"]))
        shells.append(pack.mapped(spin))
    bottom = -0.5 * f["body_height"] - f["leg_height"]
    shells += skids(0.85 * f["body_width"], 1.2 * f["body_length"], -0.3 * f["body_height"], bottom, 0.6 * arm)
    shells += camera(f, 0.1 * f["body_length"], -0.5 * f["body_height"] - 0.9 * f["camera_diameter"])
    return [Part("body", "body", tuple(shells)), *rotors(places, top, f)]


def cabin(record: dict, f: dict) -> list[Part]:
    """Return a passenger craft: a drop-shaped two-seat cabin on eight low arms and two skids."""
    places, arm = hubs(record, None), f["arm_diameter"] / 2
    length, half, height = f["body_length"], f["body_width"] / 2, f["body_height"]
    shape = ((0.5, 0.2, -0.3, -0.1), (0.44, 0.55, -0.42, 0.1), (0.25, 0.95, -0.5, 0.38), (0, 1, -0.5, 0.5),
             (-0.25, 0.85, -0.5, 0.44), (-0.42, 0.45, -0.44, 0.2), (-0.5, 0.15, -0.35, -0.05))  # fmt: skip
    shells = [hull([(y * length, w * half, a * height, b * height) for y, w, a, b in shape], 2.3, bow=0.02 * length)]
    level = -0.42 * height
    gap = f["coaxial_gap"] if record.get("coaxial") else 0.0
    top = level + arm + f["motor_height"]
    shells += motors(places, top, f)
    if gap:
        shells += motors(places, level - arm, f)
    for x, y in places:
        shells.append(tube([(0.12 * x, 0.2 * y, level), (x, y, level)], [1.5 * arm, arm]))
    bottom = -0.5 * height - f["leg_height"]
    shells += skids(0.9 * half, 0.75 * length, -0.45 * height, bottom, 0.7 * arm)
    return [Part("body", "body", tuple(shells)), *rotors(places, top, f, gap and gap + 2 * arm)]


def tanker(record: dict, f: dict) -> list[Part]:
    """Return a firefighting quadrotor: box frame, straight arms, a tank under it, wide skids and a nozzle lance."""
    places, arm = hubs(record, f["spacing_ratio"]), f["arm_diameter"] / 2
    length, width, height = f["body_length"], f["body_width"], f["body_height"]
    top = 0.5 * height + f["motor_height"]
    shells = [hull([(0.5 * length, 0.3 * width, -0.35 * height, 0.35 * height),
                    (0.35 * length, 0.5 * width, -0.5 * height, 0.5 * height),
                    (-0.35 * length, 0.5 * width, -0.5 * height, 0.5 * height),
                    (-0.5 * length, 0.3 * width, -0.35 * height, 0.35 * height)], 5.0)]  # fmt: skip
    shells += motors(places, top, f)
    for x, y in places:
        shells.append(tube([(0.12 * x, 0.12 * y, 0.2 * height), (x, y, 0.5 * height)], [1.1 * arm, arm]))
    d, span = f["tank_diameter"], f["tank_length"]
    z = -0.5 * height - 0.5 * d
    shells.append(
        hull(
            [
                (y * span, w * d / 2, z - w * d / 2, z + w * d / 2)
                for y, w in ((0.5, 0.3), (0.44, 0.8), (0.35, 1), (-0.35, 1), (-0.44, 0.8), (-0.5, 0.3))
            ],
            2.0,
        )
    )
    nose = 0.5 * length
    shells.append(tube([(0, 0.3 * length, -0.2 * height), (0, nose + f["lance_length"], -0.2 * height)],
                       [0.6 * arm, 0.35 * arm], 8))  # fmt: skip
    bottom = -0.5 * height - f["leg_height"]
    shells += skids(0.75 * width, 1.3 * length, -0.3 * height, bottom, 0.5 * arm)
    return [Part("body", "body", tuple(shells)), *rotors(places, top, f)]


LAYOUTS = {
    "folding": folding, "ducted": ducted, "raised": raised, "radial": radial, "cabin": cabin, "tanker": tanker,
}  # fmt: skip


def parts(record: dict) -> tuple[list[Part], dict]:
    """Return the parts of the craft a merged record describes, and the facts its cloud's record adds (none)."""
    return LAYOUTS[record["model"]](record, {name: value["si"] for name, value in record["figures"].items()}), {}
