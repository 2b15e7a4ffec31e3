"""From a robot's own description to a drafted record, its turning parts in one GLB file.

`robot_files` reads URDF, SDF and MJCF. All three are in metres with z up and, by convention, x to
the front.
"""

import re
from pathlib import Path

import numpy as np

from lowalt.extensions.drafting.draft import alternating, record_text, row_lines, size_word
from lowalt.extensions.drafting.front import LEVEL, Front, Shape, Turning, front_of
from lowalt.extensions.drafting.guesses import TURNING
from lowalt.extensions.drafting.robot_geometry import Joint, Robot
from lowalt.files.atomic import write_file
from lowalt.files.errors import InputError
from lowalt.targets.mesh_files import LARGEST_TRIANGLES
from lowalt.targets.mesh_record import MOVING_KIND, body_axes

WHICH = (
    "expected --category UAV, --category Bird or --category Vehicle, with --rotors N or --wheels N "
    "where no name tells "
    "their number"
)
STEERING_WHEEL = re.compile(r"steering[ _-]?wheel", re.IGNORECASE)
MOTOR = re.compile(r"(?<![a-z])mot(or)?(?![a-z])", re.IGNORECASE)
STEERED = re.compile(r"steer", re.IGNORECASE)


def _names(joint: Joint) -> tuple[str, str]:
    """The names of a joint and of the link that it turns."""
    return joint.name, joint.child.rsplit("::", 1)[-1]


def _steers(joint: Joint) -> bool:
    """Return whether a joint turns a steering wheel, whose axle is not level."""
    names = " ".join(_names(joint))
    if STEERING_WHEEL.search(names):
        return True
    return bool(STEERED.search(names)) and bool(abs(joint.axis[2]) > LEVEL)


def _called(joint: Joint, kind: str) -> bool:
    """Return whether a joint or its link is called a rotor, wheel or wing."""
    if kind == "wheel" and _steers(joint):
        return False
    return any(TURNING[kind].search(name) for name in _names(joint))


def turning(robot: Robot, kind: str, ahead: np.ndarray | None = None) -> list[Joint]:
    """Return the joints of a robot whose links are parts of a kind.

    These are the joints that names call so, else those called motors, else all that turn without
    end and are called nothing else.

    ahead: (3,) where the front is known; wings beat about it, and joints that sweep or twist them
    are held.
    """
    able = []
    for joint in robot.joints:
        turns = (joint.endless or kind == "wing") and not _steers(joint)
        if turns and any(robot.surfaces.get(link) for link in robot.below(joint.child)):
            able.append(joint)
    named = [joint for joint in able if _called(joint, kind)]
    if kind == "wing":
        return [joint for joint in named if ahead is None or abs(joint.axis @ ahead) > LEVEL]
    if named:
        return named
    others = []
    for joint in able:
        if joint.endless and not any(_called(joint, word) for word in TURNING):
            others.append(joint)
    motors = [joint for joint in others if any(map(MOTOR.search, _names(joint)))]
    return motors or others


def category_of(robot: Robot) -> str:
    """Return "UAV" where parts called rotors turn, "Vehicle" where wheels do.

    Where none turns, the links' names tell.

    Raises: InputError where both or neither are there.
    """
    kinds = ("rotor", "wheel")
    turning_joints = [joint for joint in robot.joints if joint.endless and not _steers(joint)]
    called = {}
    for kind in kinds:
        called[kind] = sum(_called(joint, kind) for joint in turning_joints)
    # A plane may have one wheel beside a motor; a vehicle has at least two, or nothing else that
    # turns.
    least = {"rotor": 1, "wheel": min(2, len(turning_joints))}
    named = [kind for kind in kinds if called[kind] and called[kind] >= least[kind]]
    if not any(called.values()):
        links = robot.surfaces
        named = [kind for kind in kinds if any(map(TURNING[kind].search, links))]
    if named == ["rotor"]:
        return "UAV"
    if named == ["wheel"]:
        return "Vehicle"
    seen = "both rotors and wheels" if named else "neither rotors nor wheels"
    raise InputError(f"its category cannot be seen, the names of its parts tell {seen}: {WHICH}")


def parts_of(
    robot: Robot, kind: str, ahead: np.ndarray | None = None
) -> tuple[dict[str, Joint], dict[str, np.ndarray]]:
    """Return the joints of the parts of a kind by name, and the triangles of each part.

    The triangles (K, 3, 3) m are also those of "body".

    ahead: (3,) the direction to the front, of which wings need to know.
    Raises: InputError where nothing is left for the body.
    """
    joints: dict[str, Joint] = {}
    taken: dict[str, str] = {}
    triangles: dict[str, list[np.ndarray]] = {}
    chosen = turning(robot, kind, ahead)
    ends = {joint.child for joint in chosen}
    for joint in chosen:
        name = joint.child.replace("::", " ")
        if name in joints or name == "body":
            name = joint.name.replace("::", " ")
        joints[name] = joint
        for link in robot.below(joint.child, ends):
            taken.setdefault(link, name)
    for link, surfaces in robot.surfaces.items():
        triangles.setdefault(taken.get(link, "body"), []).extend(surfaces)
    if "body" not in triangles:
        raise InputError("no surface is left for the body, expected links that do not turn")
    parts = {}
    for name, surfaces in triangles.items():
        if sum(map(len, surfaces)):
            parts[name] = np.concatenate(surfaces)
    return {name: joint for name, joint in joints.items() if name in parts}, parts


def write_parts(path: Path, triangles: dict[str, np.ndarray]) -> None:
    """Write the surfaces of parts into one GLB file, each a node of its name.

    Raises: InputError where they are too many.
    """
    import trimesh

    if sum(map(len, triangles.values())) > LARGEST_TRIANGLES:
        raise InputError(f"{path}: more than {LARGEST_TRIANGLES} triangles, expected fewer")
    scene = trimesh.Scene()
    for name, corners in triangles.items():
        faces = np.arange(3 * len(corners)).reshape(-1, 3)
        shape = trimesh.Trimesh(corners.reshape(-1, 3), faces, process=False)
        shape.merge_vertices()
        scene.add_geometry(shape, node_name=name, geom_name=name)
    write_file(path, scene.export(file_type="glb"))


def _above(robot: Robot, joint: Joint, joints: dict[str, Joint]) -> str:
    """The name of the part on which a joint hangs, "" for the body."""
    ends = {other.child for other in joints.values()}
    for name, other in joints.items():
        if other is not joint and joint.parent in robot.below(other.child, ends):
            return name
    return ""


def _rounded(vector: np.ndarray) -> list[float]:
    """A vector (3,) with six digits, without negative zeros."""
    return [float(f"{value:.6g}") for value in vector + 0.0]


def part_lines(
    robot: Robot, joints: dict[str, Joint], kind: str, file: str, hubs: np.ndarray, up: np.ndarray
) -> list[str]:
    """Return the lines of a record's parts: a body, and each part with hinge, axis and sense.

    Only rotors have a sense.

    hubs: (R, 2) m, the hinges in plan; up: (3,) the direction up in the file.
    """
    lines = [f"    body: {{kind: body, meshes: [{{file: {file!r}, geometry: [body]}}]}}"]
    senses = alternating(hubs)
    for (name, joint), sense in zip(joints.items(), senses, strict=True):
        hinge = _rounded(joint.hinge)
        axis = _rounded(joint.axis)
        known = robot.senses.get(joint.name)
        if known and np.dot(axis, up) < 0:
            # A record's sense is seen from above.
            known = {"ccw": "cw", "cw": "ccw"}.get(known)
        turn = ""
        mark = ""
        if kind == "rotor":
            turn = f", sense: {known or sense}"
            if not known:
                mark = "  # GUESSED sense: neighbours turn in turn"
        elif kind == "wing":
            above = _above(robot, joint, joints)
            if above:
                turn = f", parent: {above!r}"
        meshes = f"meshes: [{{file: {file!r}, geometry: [{name!r}]}}]"
        lines.append(
            f"    {name!r}: {{kind: {kind}, {meshes}, hinge: {hinge}, axis: {axis}{turn}}}{mark}"
        )
    held = [joint.name for joint in robot.joints if joint not in joints.values()]
    if held:
        lines.append(f"    # Held as drawn: {', '.join(held)}.")
    return lines


def shape_of(robot: Robot, joints: dict[str, Joint], category: str, up: np.ndarray) -> Shape:
    """Return what is seen of a robot, whose parts of the category's kind turn at `joints`; up:
    (3,).
    """
    surfaces = {}
    for link, parts in robot.surfaces.items():
        if parts:
            surfaces[link.rsplit("::", 1)[-1]] = np.concatenate(parts)
    surfaces = {link: triangles for link, triangles in surfaces.items() if len(triangles)}
    centres = {}
    for link, triangles in surfaces.items():
        centres[link] = (triangles.min(axis=(0, 1)) + triangles.max(axis=(0, 1))) / 2
    corners = np.concatenate(list(surfaces.values()))
    points = np.concatenate([corners.reshape(-1, 3), corners.mean(axis=1)])
    ends = {joint.child for joint in joints.values()}
    steered = []
    for joint in robot.joints:
        upright = not joint.endless and abs(joint.axis @ up) > LEVEL
        if upright and ends & set(robot.below(joint.child)):
            steered.append(joint.hinge)
    turning_parts = []
    for name, joint in joints.items():
        turning_parts.append(Turning(name, joint.hinge, joint.axis, signed=True))
    return Shape(category, up, points, centres, turning_parts, steered)


def front_of_robot(
    robot: Robot, joints: dict[str, Joint], category: str, axes: tuple[str | None, str | None]
) -> Front:
    """Return the front of a robot; axes: up and front where the user states them.

    Raises: InputError as `front_of`.
    """
    up = axes[0] or "z"
    upward = np.eye(3)["xyz".index(up[-1])]
    if up[0] == "-":
        upward = -upward
    usual = None if up[-1] == "x" else "x"
    return front_of(shape_of(robot, joints, category, upward), axes[1], usual, "y")


def drafted_robot(
    robot: Robot,
    parts: tuple[dict[str, Joint], dict[str, np.ndarray]],
    category: str,
    table: dict[str, dict],
    names: tuple[str, str, str],
    axes: tuple[str | None, str | None] = (None, None),
) -> str:
    """Return a record file's text of a robot whose joints tell its moving parts.

    parts: the joints by name and the triangles (K, 3, 3) m of every part; names: the subtype, the
    file described and the GLB of the parts inside the folder of inputs; axes: up and front where
    the user states them. A subtype that the table of targets lacks gets a row of its own.
    Raises: InputError where the parts contradict one another or the user about the front.
    """
    joints, triangles = parts
    subtype, source, file = names
    up = axes[0] or "z"
    front = front_of_robot(robot, joints, category, axes)
    frame = body_axes(front.axis, up)
    corners = np.concatenate(list(triangles.values())).reshape(-1, 3)
    extent = np.ptp(corners @ frame.T, axis=0)
    hubs = np.array([frame[:2] @ joint.hinge for joint in joints.values()]).reshape(-1, 2)
    across = []
    for name, joint in joints.items():
        sizes = np.ptp(triangles[name].reshape(-1, 3), axis=0)
        across.append(float(np.delete(sizes, np.abs(joint.axis).argmax()).max()))
    row = []
    if subtype not in table:
        row = row_lines(category, extent, hubs, max(across, default=None), table)
    settings = {
        "unit": "m",
        "up": up,
        "front": front.axis + front.comment,
        "size_is": size_word(category, extent, hubs),
        "licence": "unknown  # the licence of the description",
    }
    if row and category == "Vehicle":
        settings["wheel_size"] = "mesh"
    about = [
        f"Drafted from {source}, whose surfaces {file} holds in metres along the axes of the "
        "description."
    ]
    lines = part_lines(robot, joints, MOVING_KIND[category], file, hubs, frame[2])
    return record_text(about, subtype, row, settings, lines)
