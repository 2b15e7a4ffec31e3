"""Built-in multirotor layouts as closed shells.

They have a frame, motors, ducts, legs, payload and turning propellers.

Axes: front +y, right +x, up +z, metres. The origin lies in the middle between all rotors, seen from
above, at half the body's height. `records.schema.yaml` lists the figures of each layout: `hub_turn`
is how far the first hub stands from the front, as a share of the angle between hubs; a rotor of two
layers has equal blades `layer_gap` apart, the lower ones turned by `layer_turn` of a whole turn.
The factors in the code are estimates of usual proportions: they say where on the craft a shell
begins and ends, and how thick it is, as shares of the figures. The tables of shapes have rows of
`uav_pieces.shaped`.
"""

import numpy as np

from lowalt.numerics import portable
from lowalt.targets import aircraft
from lowalt.targets.assemble import Part
from lowalt.targets.record_schema import figures_si
from lowalt.targets.surfaces import box, cylinder, ring, tube
from lowalt.targets.uav_pieces import (
    camera,
    fuselage,
    hubs,
    is_coaxial,
    motor_diagonal,
    motors,
    rotors,
    shaped,
    skids,
    strut,
    turn_about_up,
)

MOVING_SHARE = 0.4
"""Share of a cloud's points on the rotors where the record has no `moving_share`; estimate.

Echo strength goes with the count of points, so it is also the rotors' share of the echo.
"""

DUCT_CLEARANCE = 1.04
"""Inner diameter of a duct over the diameter of its propeller; estimate."""
DUCT_PROFILE_SIDES = 10
DUCT_SIDES = 40
"""Sides of a duct's ring, in the section across the ring and around it."""

RADIAL_CENTRE = (
    (0.5, 0.25, -0.3, 0.3),
    (0.42, 0.6, -0.42, 0.42),
    (0.2, 0.95, -0.5, 0.5),
    (-0.2, 0.95, -0.5, 0.5),
    (-0.42, 0.6, -0.42, 0.42),
    (-0.5, 0.25, -0.3, 0.3),
)
"""The round centre of a radial multirotor; estimate."""
CABIN = (
    (0.5, 0.2, -0.3, -0.1),
    (0.44, 0.55, -0.42, 0.1),
    (0.25, 0.95, -0.5, 0.38),
    (0, 1, -0.5, 0.5),
    (-0.25, 0.85, -0.5, 0.44),
    (-0.42, 0.45, -0.44, 0.2),
    (-0.5, 0.15, -0.35, -0.05),
)
"""The drop-shaped cabin of a passenger craft; estimate."""
TANKER_FRAME = (
    (0.5, 0.6, -0.35, 0.35),
    (0.35, 1, -0.5, 0.5),
    (-0.35, 1, -0.5, 0.5),
    (-0.5, 0.6, -0.35, 0.35),
)
"""The box frame of a firefighting craft; estimate."""
TANK = (
    (0.5, 0.3, -0.15, 0.15),
    (0.44, 0.8, -0.4, 0.4),
    (0.35, 1, -0.5, 0.5),
    (-0.35, 1, -0.5, 0.5),
    (-0.44, 0.8, -0.4, 0.4),
    (-0.5, 0.3, -0.15, 0.15),
)
"""A round tank with domed ends, along y; estimate."""


def fault(record: dict) -> str | None:
    """Return the reason why a merged record is no craft that could fly or be sampled, or None."""
    figures = figures_si(record)
    if record["model"] in aircraft.LAYOUTS:
        return aircraft.fault(record)
    diagonal = motor_diagonal(record)
    size = record["published"]["size_m"]
    if diagonal <= 0 or (record["size_is"] != "body diagonal" and size < diagonal):
        return f"motor diagonal is {diagonal:.4g} m in a craft of {size} m"
    axles = hubs(record, figures)
    gap = portable.norm(axles - np.roll(axles, 1, 0)).min()
    diameter = figures["propeller_diameter"]
    if diameter >= gap:
        return (
            f"figures.propeller_diameter is {diameter:.4g} m, expected less than the {gap:.4g} m "
            "between motors"
        )
    return None


def folding(record: dict, figures: dict) -> list[Part]:
    """Return a folding camera quadrotor: fuselage, swung-out arms, front legs, nose gimbal."""
    axles = hubs(record, figures)
    top = 0.5 * figures["body_height"]
    shells = [
        fuselage(figures),
        *motors(axles, top, figures),
        *camera(figures, y=0.44 * figures["body_length"], z=-0.42 * figures["body_height"]),
    ]
    arm_radius = figures["arm_diameter"] / 2
    for x, y in axles:
        low = top - figures["motor_height"]
        if y > 0:
            root_y = 0.3 * figures["body_length"]
            rise = 0.15 * figures["body_height"]
            leg = figures["leg_height"]
        else:
            root_y = -0.34 * figures["body_length"]
            rise = -0.3 * figures["body_height"]
            leg = 0.35 * figures["leg_height"]
        root = (0.3 * np.sign(x) * figures["body_width"], root_y, rise)
        end = (x, y, low)
        foot = (x * 1.02, y, low - leg)
        shells.append(tube([root, end], [1.25 * arm_radius, 0.9 * arm_radius]))
        shells.append(strut([end, foot], [0.7 * arm_radius, 0.35 * arm_radius]))
    return [Part("body", "body", tuple(shells)), *rotors(axles, top, figures)]


def ducted(record: dict, figures: dict) -> list[Part]:
    """Return a ducted quadrotor: rings around the propellers, a pod, a battery, a nose camera."""
    axles = hubs(record, figures)
    # Radii of a duct: two of them reach beyond the motors' diagonal to the span over ducts.
    outer = (record["published"]["size_m"] - motor_diagonal(record)) / 2
    inner = figures["propeller_diameter"] / 2 * DUCT_CLEARANCE
    half_height = figures["duct_height"] / 2
    middle = (inner + outer) / 2
    half_wall = (outer - inner) / 2
    sine, cosine = portable.sine_cosine_turns(np.arange(DUCT_PROFILE_SIDES) / DUCT_PROFILE_SIDES)
    profile = np.stack([middle + half_wall * cosine, half_height * sine], 1)
    duct = ring(profile, DUCT_SIDES)
    shells = [duct.moved((x, y, 0)) for x, y in axles]
    shells += motors(axles, 0.0, figures)
    thin = figures["arm_diameter"] / 2
    # Three struts from under each motor to the duct, the first to the front.
    strut_turns = 1 / 4 + np.arange(3) / 3
    strut_directions = np.stack(portable.sine_cosine_turns(strut_turns), 1)
    for x, y in axles:
        low = -figures["motor_height"] - thin
        for sine, cosine in strut_directions:
            end = (x + middle * cosine, y + middle * sine, low)
            shells.append(strut([(x, y, low), end], thin))
    pod = fuselage(figures, taper=0.8).moved((0, 0, figures["body_height"] / 2))
    battery = box(
        (
            0.75 * figures["body_width"],
            0.45 * figures["body_length"],
            0.45 * figures["body_height"],
        ),
        (0, -0.22 * figures["body_length"], figures["body_height"]),
    )
    shells += [pod, battery]
    shells += camera(figures, y=0.52 * figures["body_length"], z=0.45 * figures["body_height"])
    for right in (-1, 1):
        for front in (-1, 1):
            x = 0.4 * right * figures["body_width"]
            y = 0.25 * front * figures["body_length"]
            leg = [(x, y, 0), (x, y, -half_height - figures["leg_height"])]
            shells.append(strut(leg, thin))
    return [Part("body", "body", tuple(shells)), *rotors(axles, 0.15 * half_height, figures)]


def raised(record: dict, figures: dict) -> list[Part]:
    """Return an H-frame craft in flight: raised side booms, a pod, cross tubes, a big gimbal."""
    axles = hubs(record, figures)
    boom_height = figures["frame_rise"]
    arm_radius = figures["arm_diameter"] / 2
    reach_x, reach_y = abs(axles).max(0)
    shells = [
        fuselage(figures, taper=0.7),
        *motors(axles, boom_height + arm_radius + figures["motor_height"], figures),
    ]
    for side in (-1, 1):
        x = side * reach_x
        boom = [(x, -1.08 * reach_y, boom_height), (x, 1.08 * reach_y, boom_height)]
        shells.append(tube(boom, arm_radius))
        root = (0.2 * side * figures["body_width"], 0, 0.1 * figures["body_height"])
        shells.append(tube([root, (x, 0, boom_height)], [1.3 * arm_radius, arm_radius]))
        for y in (-reach_y, reach_y):
            foot = (1.04 * x, y, boom_height - figures["leg_height"])
            leg = [(x, y, boom_height), foot]
            shells.append(strut(leg, [0.7 * arm_radius, 0.4 * arm_radius]))
    below_body = -0.5 * figures["body_height"] - 0.6 * figures["camera_diameter"]
    shells += camera(figures, y=0.38 * figures["body_length"], z=below_body)
    battery = box(
        (0.55 * figures["body_width"], 0.3 * figures["body_length"], 0.4 * figures["body_height"]),
        (0, -0.3 * figures["body_length"], 0.5 * figures["body_height"]),
    )
    return [
        Part("body", "body", (*shells, battery)),
        *rotors(axles, boom_height + arm_radius + 1.2 * figures["motor_height"], figures),
    ]


def radial(record: dict, figures: dict) -> list[Part]:
    """Return a radial multirotor: a round centre with batteries, straight arms, skids, a gimbal.

    It is the layout of the models `radial` and `coaxial` (`uav_pieces.is_coaxial`).
    """
    axles = hubs(record, figures)
    arm_radius = figures["arm_diameter"] / 2
    length = figures["body_length"]
    width = figures["body_width"]
    height = figures["body_height"]
    centre = shaped(RADIAL_CENTRE, length, width, height)
    coaxial = is_coaxial(record)
    # The arms carry the motors of a coaxial pair half-way between its rotors.
    top = arm_radius + figures["motor_height"]
    if coaxial:
        top = figures["layer_gap"] / 2
    shells = [centre, *motors(axles, top, figures)]
    if coaxial:
        shells += motors(axles, figures["motor_height"] - top, figures)
    battery_length = figures["battery_length"]
    battery_size = (0.4 * battery_length, battery_length, 0.5 * battery_length)
    battery = box(battery_size, (0, 0.36 * length, 0.5 * height))
    for x, y in axles:
        shells.append(tube([(0.2 * x, 0.2 * y, 0), (x, y, 0)], arm_radius))
        # The battery stands at the front; turn it to the arm, by the arm's angle from the front.
        far = np.sqrt(x * x + y * y)
        shells.append(battery.mapped(turn_about_up(sine=-x / far, cosine=y / far)))
    bottom = -0.5 * height - figures["leg_height"]
    shells += skids(
        half_track=0.85 * width,
        length=1.2 * length,
        top=-0.3 * height,
        bottom=bottom,
        radius=0.6 * arm_radius,
    )
    below_body = -0.5 * height - 0.9 * figures["camera_diameter"]
    shells += camera(figures, y=0.1 * length, z=below_body)
    return [Part("body", "body", tuple(shells)), *rotors(axles, top, figures, coaxial=coaxial)]


def cabin(record: dict, figures: dict) -> list[Part]:
    """Return a passenger craft: a drop-shaped two-seat cabin on eight low arms and two skids."""
    axles = hubs(record, figures)
    arm_radius = figures["arm_diameter"] / 2
    length = figures["body_length"]
    width = figures["body_width"]
    height = figures["body_height"]
    shells = [shaped(CABIN, length, width, height, exponent=2.3, bow=0.02 * length)]
    level = -0.42 * height
    # The arms carry their motors half-way between the two layers of blades.
    top = level + figures["layer_gap"] / 2
    low = top - figures["layer_gap"]
    radius = figures["motor_diameter"] / 2
    shells += [cylinder(radius, (x, y, low), (x, y, top)) for x, y in axles]
    for x, y in axles:
        root = (0.12 * x, 0.2 * y, level)
        shells.append(tube([root, (x, y, level)], [1.5 * arm_radius, arm_radius]))
    bottom = -0.5 * height - figures["leg_height"]
    shells += skids(
        half_track=0.9 * (width / 2),
        length=0.75 * length,
        top=-0.45 * height,
        bottom=bottom,
        radius=0.7 * arm_radius,
    )
    body = Part("body", "body", tuple(shells))
    return [body, *rotors(axles, top, figures, coaxial=is_coaxial(record))]


def tanker(record: dict, figures: dict) -> list[Part]:
    """Return a firefighting quadrotor: box frame, straight arms, a tank, wide skids, a lance."""
    axles = hubs(record, figures)
    arm_radius = figures["arm_diameter"] / 2
    length = figures["body_length"]
    width = figures["body_width"]
    height = figures["body_height"]
    top = 0.5 * height + max(figures["motor_height"], figures["layer_gap"] / 2)
    shells = [shaped(TANKER_FRAME, length, width, height, exponent=5.0)]
    shells += motors(axles, top, figures)
    for x, y in axles:
        inner = (0.12 * x, 0.12 * y, 0.2 * height)
        shells.append(tube([inner, (x, y, 0.5 * height)], [1.1 * arm_radius, arm_radius]))
    diameter = figures["tank_diameter"]
    below_frame = -0.5 * height - 0.5 * diameter
    tank_size = (figures["tank_length"], diameter, diameter)
    shells.append(shaped(TANK, *tank_size, middle=below_frame, exponent=2.0))
    level = -0.2 * height
    end = 0.5 * length + figures["lance_length"]
    lance = [(0, 0.3 * length, level), (0, end, level)]
    shells.append(strut(lance, [0.6 * arm_radius, 0.35 * arm_radius]))
    bottom = -0.5 * height - figures["leg_height"]
    shells += skids(
        half_track=0.75 * width,
        length=1.3 * length,
        top=-0.3 * height,
        bottom=bottom,
        radius=0.5 * arm_radius,
    )
    body = Part("body", "body", tuple(shells))
    return [body, *rotors(axles, top, figures, coaxial=is_coaxial(record))]


LAYOUTS = {
    "folding": folding,
    "ducted": ducted,
    "raised": raised,
    "radial": radial,
    "coaxial": radial,
    "cabin": cabin,
    "tanker": tanker,
    **aircraft.LAYOUTS,
}


def parts(record: dict) -> tuple[list[Part], dict]:
    """Return the parts of the craft that a merged record describes.

    The entries for its cloud's record, of which there are none, come second.
    """
    layout = LAYOUTS[record["model"]]
    facts: dict = {}
    return layout(record, figures_si(record)), facts
