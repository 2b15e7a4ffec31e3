"""Built-in multirotor layouts as closed shells.

They have a frame, motors, ducts, legs, payload and turning propellers.

Axes: front +y, right +x, up +z, metres. The origin lies in the middle between all rotors, seen from
above, at half the body's height. `records.schema.yaml` lists the figures of each layout: `hub_turn`
is how far the first hub stands from the front, as a share of the angle between hubs; a rotor of two
layers has equal blades `layer_gap` apart, the lower ones turned by `layer_turn` of a whole turn. A
plain factor in the code only rounds or joins shells.
"""

import numpy as np

from lowalt.numerics import portable
from lowalt.targets import aircraft
from lowalt.targets.assemble import Part
from lowalt.targets.record_schema import figures_si
from lowalt.targets.surfaces import box, cylinder, hull, ring, tube
from lowalt.targets.uav_pieces import camera, fuselage, hubs, motor_diagonal, motors, rotors, skids

MOVING_SHARE = 0.4


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


def folding(record: dict, f: dict) -> list[Part]:
    """Return a folding camera quadrotor: fuselage, swung-out arms, front legs, nose gimbal."""
    axles = hubs(record, f)
    top = 0.5 * f["body_height"]
    shells = [
        fuselage(f),
        *motors(axles, top, f),
        *camera(f, 0.44 * f["body_length"], -0.42 * f["body_height"]),
    ]
    arm = f["arm_diameter"] / 2
    for x, y in axles:
        low = top - f["motor_height"]
        if y > 0:
            root_y = 0.3 * f["body_length"]
            rise = 0.15 * f["body_height"]
            leg = f["leg_height"]
        else:
            root_y = -0.34 * f["body_length"]
            rise = -0.3 * f["body_height"]
            leg = 0.35 * f["leg_height"]
        root = (0.3 * np.sign(x) * f["body_width"], root_y, rise)
        end = (x, y, low)
        foot = (x * 1.02, y, low - leg)
        shells.append(tube([root, end], [1.25 * arm, 0.9 * arm]))
        shells.append(tube([end, foot], [0.7 * arm, 0.35 * arm], 8))
    return [Part("body", "body", tuple(shells)), *rotors(axles, top, f)]


def ducted(record: dict, f: dict) -> list[Part]:
    """Return a ducted quadrotor: rings around the propellers, a pod, a battery, a nose camera."""
    axles = hubs(record, f)
    outer = (record["published"]["size_m"] - motor_diagonal(record)) / 2
    inner = f["propeller_diameter"] / 2 * 1.04
    half = f["duct_height"] / 2
    middle = (inner + outer) / 2
    wall = (outer - inner) / 2
    sine, cosine = portable.sine_cosine_turns(np.arange(10) / 10)
    duct = ring(np.stack([middle + wall * cosine, half * sine], 1), 40)
    shells = [duct.moved((x, y, 0)) for x, y in axles] + motors(axles, 0.0, f)
    for x, y in axles:
        low = -f["motor_height"] - f["arm_diameter"] / 2
        for sine, cosine in zip(*portable.sine_cosine_turns(1 / 4 + np.arange(3) / 3), strict=True):
            end = (x + middle * cosine, y + middle * sine, low)
            shells.append(tube([(x, y, low), end], f["arm_diameter"] / 2, 8))
    pod = fuselage(f, 0.8).moved((0, 0, f["body_height"] / 2))
    battery = box(
        (0.75 * f["body_width"], 0.45 * f["body_length"], 0.45 * f["body_height"]),
        (0, -0.22 * f["body_length"], f["body_height"]),
    )
    shells += [pod, battery, *camera(f, 0.52 * f["body_length"], 0.45 * f["body_height"])]
    for right in (-1, 1):
        for front in (-1, 1):
            x = 0.4 * right * f["body_width"]
            y = 0.25 * front * f["body_length"]
            leg = [(x, y, 0), (x, y, -half - f["leg_height"])]
            shells.append(tube(leg, f["arm_diameter"] / 2, 8))
    return [Part("body", "body", tuple(shells)), *rotors(axles, 0.15 * half, f)]


def raised(record: dict, f: dict) -> list[Part]:
    """Return an H-frame craft in flight: raised side booms, a pod, cross tubes, a big gimbal."""
    axles = hubs(record, f)
    boom = f["frame_rise"]
    arm = f["arm_diameter"] / 2
    reach_x, reach_y = abs(axles).max(0)
    shells = [fuselage(f, 0.7), *motors(axles, boom + arm + f["motor_height"], f)]
    for side in (-1, 1):
        x = side * reach_x
        shells.append(tube([(x, -1.08 * reach_y, boom), (x, 1.08 * reach_y, boom)], arm))
        root = (0.2 * side * f["body_width"], 0, 0.1 * f["body_height"])
        shells.append(tube([root, (x, 0, boom)], [1.3 * arm, arm]))
        for y in (-reach_y, reach_y):
            foot = (1.04 * x, y, boom - f["leg_height"])
            shells.append(tube([(x, y, boom), foot], [0.7 * arm, 0.4 * arm], 8))
    d = f["camera_diameter"]
    shells += camera(f, 0.38 * f["body_length"], -0.5 * f["body_height"] - 0.6 * d)
    battery = box(
        (0.55 * f["body_width"], 0.3 * f["body_length"], 0.4 * f["body_height"]),
        (0, -0.3 * f["body_length"], 0.5 * f["body_height"]),
    )
    return [
        Part("body", "body", (*shells, battery)),
        *rotors(axles, boom + arm + 1.2 * f["motor_height"], f),
    ]


def radial(record: dict, f: dict) -> list[Part]:
    """Return a radial multirotor: a round centre with batteries, straight arms, skids, a gimbal.

    With a figure `layer_gap` each arm carries two rotors, one above the other, that turn against
    each other.
    """
    axles = hubs(record, f)
    arm = f["arm_diameter"] / 2
    # Position to the front, half width and half height, as shares of the body's measures.
    shape = (
        (0.5, 0.25, 0.3),
        (0.42, 0.6, 0.42),
        (0.2, 0.95, 0.5),
        (-0.2, 0.95, 0.5),
        (-0.42, 0.6, 0.42),
        (-0.5, 0.25, 0.3),
    )
    length = f["body_length"]
    width = f["body_width"]
    height = f["body_height"]
    centre = hull([(y * length, w * width / 2, -h * height, h * height) for y, w, h in shape])
    coaxial = "layer_gap" in f
    # The arms carry the motors of a coaxial pair half-way between its rotors.
    top = arm + f["motor_height"]
    if coaxial:
        top = f["layer_gap"] / 2
    shells = [centre, *motors(axles, top, f)]
    if coaxial:
        shells += motors(axles, f["motor_height"] - top, f)
    cell = f["battery_length"]
    for x, y in axles:
        shells.append(tube([(0.2 * x, 0.2 * y, 0), (x, y, 0)], arm))
        # Turn from the front to the arm's direction, by the arm's angle minus a quarter turn.
        far = np.sqrt(x * x + y * y)
        sine = -x / far
        cosine = y / far
        spin = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
        pack = box((0.4 * cell, cell, 0.5 * cell), (0, 0.36 * length, 0.5 * height))
        shells.append(pack.mapped(spin))
    bottom = -0.5 * height - f["leg_height"]
    shells += skids(0.85 * width, 1.2 * length, -0.3 * height, bottom, 0.6 * arm)
    shells += camera(f, 0.1 * length, -0.5 * height - 0.9 * f["camera_diameter"])
    return [Part("body", "body", tuple(shells)), *rotors(axles, top, f, coaxial)]


def cabin(record: dict, f: dict) -> list[Part]:
    """Return a passenger craft: a drop-shaped two-seat cabin on eight low arms and two skids."""
    axles = hubs(record, f)
    arm = f["arm_diameter"] / 2
    length = f["body_length"]
    half = f["body_width"] / 2
    height = f["body_height"]
    shape = (
        (0.5, 0.2, -0.3, -0.1),
        (0.44, 0.55, -0.42, 0.1),
        (0.25, 0.95, -0.5, 0.38),
        (0, 1, -0.5, 0.5),
        (-0.25, 0.85, -0.5, 0.44),
        (-0.42, 0.45, -0.44, 0.2),
        (-0.5, 0.15, -0.35, -0.05),
    )
    stations = [(y * length, w * half, low * height, high * height) for y, w, low, high in shape]
    shells = [hull(stations, 2.3, bow=0.02 * length)]
    level = -0.42 * height
    # The arms carry their motors half-way between the two layers of blades.
    top = level + f["layer_gap"] / 2
    low = top - f["layer_gap"]
    radius = f["motor_diameter"] / 2
    shells += [cylinder(radius, (x, y, low), (x, y, top)) for x, y in axles]
    for x, y in axles:
        root = (0.12 * x, 0.2 * y, level)
        shells.append(tube([root, (x, y, level)], [1.5 * arm, arm]))
    bottom = -0.5 * height - f["leg_height"]
    shells += skids(0.9 * half, 0.75 * length, -0.45 * height, bottom, 0.7 * arm)
    return [
        Part("body", "body", tuple(shells)),
        *rotors(axles, top, f, bool(record.get("coaxial"))),
    ]


def tanker(record: dict, f: dict) -> list[Part]:
    """Return a firefighting quadrotor: box frame, straight arms, a tank, wide skids, a lance."""
    axles = hubs(record, f)
    arm = f["arm_diameter"] / 2
    length = f["body_length"]
    width = f["body_width"]
    height = f["body_height"]
    top = 0.5 * height + max(f["motor_height"], f["layer_gap"] / 2)
    # Position to the front, half width and half height, as shares of the body's measures.
    frame = ((0.5, 0.3, 0.35), (0.35, 0.5, 0.5), (-0.35, 0.5, 0.5), (-0.5, 0.3, 0.35))
    shells = [hull([(y * length, w * width, -h * height, h * height) for y, w, h in frame], 5.0)]
    shells += motors(axles, top, f)
    for x, y in axles:
        inner = (0.12 * x, 0.12 * y, 0.2 * height)
        shells.append(tube([inner, (x, y, 0.5 * height)], [1.1 * arm, arm]))
    d = f["tank_diameter"]
    span = f["tank_length"]
    z = -0.5 * height - 0.5 * d
    # Position along the tank and radius, as shares of its length and radius.
    tank = ((0.5, 0.3), (0.44, 0.8), (0.35, 1), (-0.35, 1), (-0.44, 0.8), (-0.5, 0.3))
    stations = [(y * span, w * d / 2, z - w * d / 2, z + w * d / 2) for y, w in tank]
    shells.append(hull(stations, 2.0))
    level = -0.2 * height
    end = 0.5 * length + f["lance_length"]
    lance = [(0, 0.3 * length, level), (0, end, level)]
    shells.append(tube(lance, [0.6 * arm, 0.35 * arm], 8))
    bottom = -0.5 * height - f["leg_height"]
    shells += skids(0.75 * width, 1.3 * length, -0.3 * height, bottom, 0.5 * arm)
    return [
        Part("body", "body", tuple(shells)),
        *rotors(axles, top, f, bool(record.get("coaxial"))),
    ]


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
    return layout(record, figures_si(record)), {}
