"""Pieces that multirotor layouts share: propellers, motors, fuselage, gimbal and skids.

Axes: front +y, right +x, up +z, metres. `figure` is a record's figures in SI units by name.
"""

import numpy as np

from lowalt.numerics import portable
from lowalt.targets.assemble import Part
from lowalt.targets.surfaces import Surface, cylinder, ellipsoid, foil, hull, tube


def motor_diagonal(record: dict) -> float:
    """Return the largest distance between motor axes (m) at which the craft's size is published."""
    size = record["published"]["size_m"]
    figure = record["figures"]
    if record["size_is"] in ("body diagonal", "span over ducts"):
        return figure["motor_diagonal"]["si"]
    if record["size_is"] == "span over rotors":
        return size - figure["propeller_diameter"]["si"]
    return size


def hubs(record: dict, figure: dict) -> np.ndarray:
    """Return the motor axes' positions (R, 2) in plan (m), counted anticlockwise from above.

    With a `spacing_ratio` (lateral over longitudinal) four axes stand at the corners of a
    rectangle. Otherwise they stand evenly on a circle, the first by `hub_turn` of the angle between
    two of them from the front.
    """
    ratio = figure.get("spacing_ratio")
    reach = motor_diagonal(record) / 2
    count = record["published"]["n_rotors_or_wings"]
    if ratio is not None:
        slant = np.sqrt(1 + ratio * ratio)
        front = np.array([1, 1, -1, -1]) / slant
        right = np.array([1, -1, -1, 1]) * ratio / slant
    else:
        turns = 1 / 4 + (np.arange(count) - figure["hub_turn"]) / count
        front, right = portable.sine_cosine_turns(turns)
    return reach * np.stack([right, front], 1)


def blade(diameter: float, chord: float, sense: int) -> Surface:
    """Return one propeller blade along +x, hub at the origin.

    sense: of the rotor, 1 anticlockwise (leading edge at +y), -1 clockwise.

    The twist follows a constant pitch of two thirds of the diameter; the chord is largest at 0.35
    of the radius.
    """
    radius = diameter / 2
    stations = np.array([0.08, 0.2, 0.35, 0.55, 0.75, 0.92, 1.0])
    chords = chord * np.array([0.55, 0.85, 1.0, 0.88, 0.68, 0.5, 0.25])
    twist = portable.arctan(4 / 3 / (2 * np.pi * np.maximum(stations, 0.2)))
    rows = [(x * radius, 0, 0, c, t) for x, c, t in zip(stations, chords, twist, strict=True)]
    shell = foil(rows, thickness=0.10)
    if sense < 0:
        return shell.mapped(np.diag([1.0, -1.0, 1.0]))
    return shell


def rotor(
    name: str, hub: np.ndarray, sense: int, figure: dict, layers: tuple[tuple[float, float], ...]
) -> Part:
    """Return the rotor about `hub` (3,): equal blades, of which the first is square to the arm.

    sense: 1 where the axis points up, -1 down. layers: depth below the hub (m) and turn of each
    layer of blades.
    """
    shell = blade(figure["propeller_diameter"], figure["blade_chord"], sense)
    # Turn the blade to the hub's direction and by a quarter turn more.
    far = np.sqrt(hub[0] * hub[0] + hub[1] * hub[1])
    sine = 1.0
    cosine = 0.0
    if far > 0:
        sine = hub[0] / far
        cosine = -hub[1] / far
    shells = []
    for depth, turn in layers:
        layer_sine, layer_cosine = portable.sine_cosine_turns(np.array(turn))
        # The sums of angles; each layer turns on from the one above it.
        turned = float(sine * layer_cosine + cosine * layer_sine)
        cosine = float(cosine * layer_cosine - sine * layer_sine)
        sine = turned
        matrix = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
        shells.append(shell.mapped(matrix).moved(hub - [0, 0, depth]))
    axis = (0.0, 0.0, float(sense))
    return Part(name, "rotor", tuple(shells), tuple(hub), axis, copies=int(figure["blade_count"]))


def rotors(axles: np.ndarray, height: float, figure: dict, apart: bool = False) -> list[Part]:
    """Return the rotors on the motor axes (R, 2) at `height`; neighbours turn in opposite senses.

    With a figure `layer_gap` each rotor has two layers of blades. apart: whether the lower layer is
    a rotor of its own, which turns against the upper one.
    """
    parts = []
    single = ((0.0, 0.0),)
    layers: tuple[tuple[float, float], ...] = single
    if "layer_gap" in figure and not apart:
        layers = (*single, (figure["layer_gap"], figure["layer_turn"]))
    for index, (x, y) in enumerate(axles):
        sense = 1 if index % 2 == 0 else -1
        parts.append(rotor(f"rotor {index + 1}", np.array([x, y, height]), sense, figure, layers))
        if apart:
            low = np.array([x, y, height - figure["layer_gap"]])
            parts.append(rotor(f"rotor {index + 1} lower", low, -sense, figure, single))
    return parts


def motors(axles: np.ndarray, top: float, figure: dict) -> list[Surface]:
    """Return the motors as cylinders below the rotors (R, 2), their upper ends at `top` (m)."""
    low = top - figure["motor_height"]
    radius = figure["motor_diameter"] / 2
    return [cylinder(radius, (x, y, low), (x, y, top)) for x, y in axles]


def fuselage(figure: dict, taper: float = 0.55) -> Surface:
    """Return a slender fuselage along y, blunt at the nose and tapering to the tail."""
    length = figure["body_length"]
    width = figure["body_width"]
    height = figure["body_height"]
    # Position to the front, half width, lower and upper edge, as shares of the body's measures.
    shape = (
        (0.5, 0.62, -0.25, 0.28),
        (0.42, 0.85, -0.42, 0.42),
        (0.1, 1, -0.5, 0.5),
        (-0.3, 0.95, -0.5, 0.46),
        (-0.5, taper, -0.3, 0.3),
    )
    stations = [(y * length, w * width / 2, low * height, top * height) for y, w, low, top in shape]
    return hull(stations, exponent=3.2)


def camera(figure: dict, y: float, z: float) -> list[Surface]:
    """Return a gimbal: a ball at (0, y, z) with its lens, below a short vertical bar."""
    d = figure["camera_diameter"]
    lens = cylinder(d * 0.28, (0, y + 0.3 * d, z), (0, y + 0.62 * d, z))
    return [
        ellipsoid((d / 2, d / 2, d / 2), (0, y, z)),
        lens,
        cylinder(d * 0.12, (0, y, z), (0, y, z + 0.9 * d), 8),
    ]


def skids(
    half_track: float, length: float, top: float, bottom: float, radius: float
) -> list[Surface]:
    """Return two landing skids: inclined struts from the body to runners along y."""
    shells = []
    for side in (-1, 1):
        foot = side * half_track
        height = bottom + radius
        runner = [(foot, -length / 2, height), (foot, length / 2, height)]
        shells.append(tube(runner, radius, 8))
        for y in (-0.28 * length, 0.28 * length):
            shells.append(tube([(0.4 * foot, 0.7 * y, top), (foot, y, height)], radius, 8))
    return shells
