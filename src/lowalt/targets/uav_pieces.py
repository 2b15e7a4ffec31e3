"""Pieces that multirotor layouts share: propellers, motors, fuselage, gimbal and skids.

Axes: front +y, right +x, up +z, metres. `figures` holds a record's figures in SI units by name.
Numbers without a source are estimates of the usual proportions of such pieces.
"""

from collections.abc import Iterable

import numpy as np

from lowalt.numerics import portable
from lowalt.targets.assemble import Part
from lowalt.targets.record_schema import figures_si
from lowalt.targets.surfaces import Surface, cylinder, ellipsoid, foil, hull, tube

STRUT_SIDES = 8
"""Sides of a thin tube, such as a leg."""

BLADE_SHAPE = np.array(
    [
        [0.08, 0.55],
        [0.2, 0.85],
        [0.35, 1.0],
        [0.55, 0.88],
        [0.75, 0.68],
        [0.92, 0.5],
        [1.0, 0.25],
    ]
)
"""A propeller blade: distance from the axis over the radius, chord over the largest one; estimate."""
BLADE_PITCH = 4 / 3
"""Pitch of a propeller over its radius, two thirds of the diameter; estimate."""
BLADE_THICKNESS = 0.10
"""Largest thickness of a blade over its chord; estimate."""

FUSELAGE_SHAPE = (
    (0.5, 0.62, -0.25, 0.28),
    (0.42, 0.85, -0.42, 0.42),
    (0.1, 1, -0.5, 0.5),
    (-0.3, 0.95, -0.5, 0.46),
)
"""A fuselage without its tail, as rows of `shaped`; estimate."""


def shaped(
    shape: Iterable[tuple[float, float, float, float]],
    length: float,
    width: float,
    height: float,
    middle: float = 0.0,
    exponent: float = 2.5,
    bow: float = 0.0,
) -> Surface:
    """Return a hull along y from the rows of a shape, which are shares of its measures (m).

    A row of `shape` holds the position to the front over `length`, the whole width there over
    `width`, and the lower and the upper edge over `height`, both from the height `middle` (m).
    exponent, bow: as for `surfaces.hull`.
    """
    stations = []
    for y, wide, low, high in shape:
        half_width = wide * width / 2
        stations.append((y * length, half_width, middle + low * height, middle + high * height))
    return hull(stations, exponent=exponent, bow=bow)


def turn_about_up(sine: float, cosine: float) -> np.ndarray:
    """Return the rotation matrix (3, 3) about +z by the angle with this sine and cosine."""
    return np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])


def strut(path: list, radius: np.ndarray | list | float) -> Surface:
    """Return a thin round tube along `path` (K, 3), such as a leg, with few sides."""
    return tube(path, radius, STRUT_SIDES)


def is_coaxial(record: dict) -> bool:
    """Return whether the two layers of blades on an axis are rotors that turn in opposite senses.

    In the model `coaxial` they always are, in other models where the record says `coaxial`.
    """
    return record["model"] == "coaxial" or bool(record.get("coaxial"))


def motor_diagonal(record: dict) -> float:
    """Return the largest distance between motor axes (m) at which the craft's size is published."""
    size = record["published"]["size_m"]
    figures = figures_si(record)
    if record["size_is"] in ("body diagonal", "span over ducts"):
        return figures["motor_diagonal"]
    if record["size_is"] == "span over rotors":
        return size - figures["propeller_diameter"]
    return size


def hubs(record: dict, figures: dict) -> np.ndarray:
    """Return the motor axes' positions (R, 2) in plan (m), counted anticlockwise from above.

    With a `spacing_ratio` (lateral over longitudinal) four axes stand at the corners of a
    rectangle. Otherwise they stand evenly on a circle, the first by `hub_turn` of the angle between
    two of them from the front.
    """
    ratio = figures.get("spacing_ratio")
    reach = motor_diagonal(record) / 2
    count = record["published"]["n_rotors_or_wings"]
    if ratio is not None:
        # The rectangle's diagonal where its side along y is 1; then the signs of the corners in the
        # order front right, front left, rear left, rear right.
        diagonal = np.sqrt(1 + ratio * ratio)
        front = np.array([1, 1, -1, -1]) / diagonal
        right = np.array([1, -1, -1, 1]) * ratio / diagonal
    else:
        turns = 1 / 4 + (np.arange(count) - figures["hub_turn"]) / count
        front, right = portable.sine_cosine_turns(turns)
    return reach * np.stack([right, front], 1)


def blade(diameter: float, chord: float, sense: int) -> Surface:
    """Return one propeller blade along +x, hub at the origin.

    sense: of the rotor, 1 anticlockwise (leading edge at +y), -1 clockwise.
    chord: the largest one (m). The twist follows from the constant pitch BLADE_PITCH.
    """
    radius = diameter / 2
    stations = BLADE_SHAPE[:, 0]
    chords = chord * BLADE_SHAPE[:, 1]
    # The hub stops the twist from growing further towards the axis.
    advancing = np.maximum(stations, 0.2)
    twists = portable.arctan(BLADE_PITCH / (2 * np.pi * advancing))
    rows = []
    for station, station_chord, twist in zip(stations, chords, twists, strict=True):
        rows.append((station * radius, 0, 0, station_chord, twist))
    shell = foil(rows, thickness=BLADE_THICKNESS)
    if sense < 0:
        return shell.mapped(np.diag([1.0, -1.0, 1.0]))
    return shell


def rotor(
    name: str, hub: np.ndarray, sense: int, figures: dict, layers: tuple[tuple[float, float], ...]
) -> Part:
    """Return the rotor about `hub` (3,): equal blades, of which the first is square to the arm.

    sense: 1 where the axis points up, -1 down. layers: depth below the hub (m) and turn of each
    layer of blades.
    """
    shell = blade(figures["propeller_diameter"], figures["blade_chord"], sense)
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
        turned_shell = shell.mapped(turn_about_up(sine, cosine))
        shells.append(turned_shell.moved(hub - [0, 0, depth]))
    return Part(
        name,
        "rotor",
        tuple(shells),
        hinge=tuple(hub),
        axis=(0.0, 0.0, float(sense)),
        copies=int(figures["blade_count"]),
    )


def rotors(axles: np.ndarray, height: float, figures: dict, coaxial: bool = False) -> list[Part]:
    """Return the rotors on the motor axes (R, 2) at `height`; neighbours turn in opposite senses.

    With a figure `layer_gap` there are two layers of blades on each axis. coaxial (`is_coaxial`):
    whether the lower layer is a rotor of its own; otherwise both layers turn together.
    """
    parts = []
    single = ((0.0, 0.0),)
    layers: tuple[tuple[float, float], ...] = single
    if "layer_gap" in figures and not coaxial:
        layers = (*single, (figures["layer_gap"], figures["layer_turn"]))
    for index, (x, y) in enumerate(axles):
        sense = 1 if index % 2 == 0 else -1
        top = np.array([x, y, height])
        parts.append(rotor(f"rotor {index + 1}", top, sense, figures, layers))
        if coaxial:
            low = np.array([x, y, height - figures["layer_gap"]])
            parts.append(rotor(f"rotor {index + 1} lower", low, -sense, figures, single))
    return parts


def motors(axles: np.ndarray, top: float, figures: dict) -> list[Surface]:
    """Return the motors as cylinders below the rotors (R, 2), their upper ends at `top` (m)."""
    low = top - figures["motor_height"]
    radius = figures["motor_diameter"] / 2
    return [cylinder(radius, (x, y, low), (x, y, top)) for x, y in axles]


def fuselage(figures: dict, taper: float = 0.55) -> Surface:
    """Return a slender fuselage along y, blunt at the nose and tapering to the tail.

    taper: width of the tail's end over the largest width.
    """
    tail = (-0.5, taper, -0.3, 0.3)
    return shaped(
        (*FUSELAGE_SHAPE, tail),
        figures["body_length"],
        figures["body_width"],
        figures["body_height"],
        exponent=3.2,
    )


def camera(figures: dict, y: float, z: float) -> list[Surface]:
    """Return a gimbal: a ball at (0, y, z) with its lens, below a short vertical bar."""
    diameter = figures["camera_diameter"]
    radius = diameter / 2
    ball = ellipsoid((radius, radius, radius), (0, y, z))
    lens_start = (0, y + 0.3 * diameter, z)
    lens_end = (0, y + 0.62 * diameter, z)
    lens = cylinder(diameter * 0.28, lens_start, lens_end)
    bar = cylinder(diameter * 0.12, (0, y, z), (0, y, z + 0.9 * diameter), STRUT_SIDES)
    return [ball, lens, bar]


def skids(
    half_track: float, length: float, top: float, bottom: float, radius: float
) -> list[Surface]:
    """Return two landing skids: inclined struts from the body to runners along y (m).

    half_track: distance of a runner from the middle; top, bottom: heights of the struts' upper ends
    and of the runners' undersides; radius: of struts and runners.
    """
    shells = []
    for side in (-1, 1):
        foot = side * half_track
        height = bottom + radius
        runner = [(foot, -length / 2, height), (foot, length / 2, height)]
        shells.append(strut(runner, radius))
        # Struts begin nearer to the body's middle than they end, to both sides and lengthwise.
        for y in (-0.28 * length, 0.28 * length):
            root = (0.4 * foot, 0.7 * y, top)
            shells.append(strut([root, (foot, y, height)], radius))
    return shells
