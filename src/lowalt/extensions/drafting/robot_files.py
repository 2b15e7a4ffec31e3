"""Reading URDF and SDF: links, poses, units, surfaces and joints; nothing outside the folder of
inputs is opened.

Sources: ROS, urdf/XML (link, joint); SDFormat 1.4 to 1.11 and its proposal on pose frames. MJCF is
read in `robot_mjcf`. yourdfpy reads URDF alone; the three formats share what is in
`robot_geometry`.
"""

import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from lowalt.extensions.drafting.robot_geometry import (
    DEEPEST,
    Files,
    Robot,
    numbers,
    place_of,
    primitive,
)
from lowalt.extensions.drafting.robot_mjcf import mjcf
from lowalt.files.errors import InputError, reading
from lowalt.numerics import portable

KINDS = (".urdf", ".sdf", ".xml", ".mjcf", ".world")
TEMPLATES = {
    ".xacro": "xacro FILE > robot.urdf",
    ".jinja": "the project's own script (PX4: jinja_gen.py FILE)",
    ".erb": "erb FILE > robot.sdf",
}
"""Templates of descriptions by suffix, and what expands them."""
UNUSED = ("gazebo", "transmission", "sensor", "ros2_control")
"""Elements inside a description that say nothing about shapes and joints; macros in them do no
harm.
"""


def _geometry(element: Element | None, base: Path, files: Files) -> np.ndarray:
    """Return the triangles (K, 3, 3) of a `geometry` of URDF or SDF. Planes and unknown shapes have
    none.
    """
    for shape in element if element is not None else ():
        values = {**shape.attrib, **{child.tag: child.text or "" for child in shape}}
        if shape.tag == "mesh":
            scale = numbers(values.get("scale"), 3, (1, 1, 1))
            part = shape.findtext("submesh/name")
            triangles = files.mesh(values.get("filename", values.get("uri", "")), base, scale, part)
            if shape.findtext("submesh/center") in ("1", "true") and len(triangles):
                triangles = (
                    triangles - (triangles.min(axis=(0, 1)) + triangles.max(axis=(0, 1))) / 2
                )
            return triangles
        if shape.tag == "box":
            return primitive("box", numbers(values.get("size"), 3, ()))
        if shape.tag in ("cylinder", "capsule"):
            return primitive(
                shape.tag, np.array([float(values["radius"]), float(values["length"])])
            )
        if shape.tag in ("sphere", "ellipsoid"):
            return primitive(shape.tag, numbers(values.get("radius", values.get("radii")), 3, ()))
    return np.zeros((0, 3, 3))


def _pose(element: Element) -> np.ndarray:
    """The place (4, 4) that an element has in its `pose` (SDF) or its `origin` (URDF)."""
    pose = element.find("pose")
    origin = element.find("origin")
    if origin is not None:
        shift, turn = (numbers(origin.get(key), 3, (0, 0, 0)) for key in ("xyz", "rpy"))
        return place_of(shift, Rotation.from_euler("xyz", turn))
    if pose is None or not (pose.text or "").strip():
        return np.eye(4)
    quaternion = pose.get("rotation_format") == "quat_xyzw"
    values = numbers(pose.text, 7 if quaternion else 6, ())
    degrees = pose.get("degrees") == "true"
    turn = (
        Rotation.from_quat(values[3:])
        if quaternion
        else Rotation.from_euler("xyz", values[3:], degrees=degrees)
    )
    return place_of(values[:3], turn)


def _version(root: Element) -> tuple[int, ...]:
    """Return the version of an SDF file as integers, since 1.10 comes after 1.9."""
    return tuple(int(number) for number in root.get("version", "1.5").split("."))


def _axis_frame(joint: Element, version: tuple[int, ...], own: str, model: str, scope: str) -> str:
    """Return the frame in which the axis of an SDF joint is given: the joint's `own`, the model's
    or a named one.

    Before version 1.5 it is the model's, from 1.5 to 1.6 where `use_parent_model_frame` says so,
    from 1.7 on the one that `expressed_in` names.
    """
    along = joint.find("axis/xyz")
    within = along.get("expressed_in") if along is not None else None
    in_model = version < (1, 7) and joint.findtext("axis/use_parent_model_frame") in ("1", "true")
    if version < (1, 5) or in_model or within == "__model__":
        return model
    return scope + within if within else own


class _Links:
    """Links and joints by scoped name, at frames that each have a place in another frame, resolved
    at the end.
    """

    def __init__(self, files: Files) -> None:
        self.files = files
        self.robot = Robot()
        self.frames: dict[str, tuple[str, np.ndarray]] = {"": ("", np.eye(4))}
        self.links: list[tuple[str, Element, Path]] = []
        self.joints: list[
            tuple[str, str, list[str], Element, np.ndarray, str, tuple[str | None, str | None]]
        ] = []

    def place(self, frame: str, depth: int = 0) -> np.ndarray:
        """The place (4, 4) of a frame."""
        if frame == "":
            return np.eye(4)
        if frame not in self.frames:
            raise ValueError(f"frame {frame!r} is unknown")
        # A joint of a URDF is a frame between two links.
        if depth > 2 * DEEPEST:
            raise ValueError(f"frame {frame!r} hangs on itself, or is deeper than {DEEPEST} links")
        above, in_above = self.frames[frame]
        return portable.product(self.place(above, depth + 1), in_above)

    def urdf(self, root: Element, base: Path) -> Robot:
        """The robot of a URDF: a joint stands on its parent, and its child in it."""
        for link in root.findall("link"):
            name = link.get("name", "")
            self.frames[name] = ("", np.eye(4))
            self.links.append((name, link, base))
        for joint in root.findall("joint"):
            parent, child = (joint.find(end).get("link") for end in ("parent", "child"))
            name = joint.get("name", child)
            along = joint.find("axis")
            limit = joint.find("limit")
            frame = f"{name} joint"
            self.frames.setdefault(
                parent, ("", np.eye(4))
            )  # such as the world, which need not be a link
            self.frames[frame], self.frames[child] = (parent, _pose(joint)), (frame, np.eye(4))
            axis = numbers(along.get("xyz") if along is not None else None, 3, (1, 0, 0))
            limits = (
                (limit.get("lower", "0"), limit.get("upper", "0"))
                if limit is not None
                else (None, None)
            )
            self.joints.append((name, "", [parent, child], joint, axis, frame, limits))
        return self.done()

    def sdf(self, root: Element, base: Path) -> Robot:
        """The robot of an SDF: its model, or the only one of its world, wherever the world has it."""
        models = [*root.findall("model"), *root.findall("world/model")]
        if len(models) != 1:
            raise ValueError(f"{len(models)} models, expected one")
        self.add(models[0], base, "", ("", np.eye(4)), _version(root), 0)
        return self.done()

    def add(
        self,
        model: Element,
        base: Path,
        scope: str,
        place: tuple[str, np.ndarray],
        version: tuple[int, ...],
        depth: int,
    ) -> None:
        """Add the links, frames, joints and inner models of an SDF; `scope` ends in :: where it has
        a name.
        """
        if depth > DEEPEST:
            raise ValueError("models in a circle")
        inner = f"{scope}__model__ {len(self.frames)}"  # of merged models several have one scope
        self.frames[inner] = place

        def placed(element: Element, default: str) -> tuple[str, np.ndarray]:
            """The frame that an element's pose is relative to, and its place there."""
            pose = element.find("pose")
            name = pose.get("relative_to", "") if pose is not None else ""
            return inner if name == "__model__" else scope + name if name else default, _pose(
                element
            )

        for child in model:
            name = scope + child.get("name", "")
            if child.tag == "link":
                self.frames[name] = placed(child, inner)  # over a joint of that name
                self.links.append((name, child, base))
            elif child.tag == "frame":
                attached = child.get("attached_to")
                self.frames[name] = placed(child, scope + attached if attached else inner)
            elif child.tag == "joint":
                frame = f"{name} joint"  # links and joints of one name are told apart
                ends = [(child.findtext(end) or "").strip() for end in ("parent", "child")]
                self.frames[frame] = placed(child, scope + ends[1])
                self.frames.setdefault(name, (frame, np.eye(4)))
                along = child.find("axis/xyz")
                axis = numbers(along.text if along is not None else None, 3, (0, 0, 1))
                frame = _axis_frame(child, version, frame, inner, scope)
                limits = (child.findtext("axis/limit/lower"), child.findtext("axis/limit/upper"))
                self.joints.append((name, scope, ends, child, axis, frame, limits))
            elif (
                child.tag == "plugin"
                and child.findtext("jointName")
                and child.findtext("turningDirection")
            ):
                joint, turn = (
                    child.findtext(word, "").strip() for word in ("jointName", "turningDirection")
                )
                self.robot.senses[scope + joint] = turn
            elif child.tag == "model":
                self.add(child, base, f"{name}::", placed(child, inner), version, depth + 1)
            elif child.tag == "include":
                self.include(child, base, scope, placed(child, inner)[0], depth)

    def include(self, element: Element, base: Path, scope: str, above: str, depth: int) -> None:
        """Take the model that an element `include` names."""
        uri = (element.findtext("uri") or "").strip()
        named = (
            "/" not in uri and not (base / uri).exists()
        )  # Gazebo looks for such a name among its models
        path = self.files.find(f"model://{uri}" if named else uri, base)
        if path.is_dir():
            config = path / "model.config"
            listed = self.files.parsed(config).findtext("sdf") if config.exists() else None
            path = self.files.find((listed or "model.sdf").strip(), path)
        root = self.files.parsed(path)
        model = root.find("model")
        if model is None:
            raise ValueError(f"{path.name} holds no model")
        merged = element.get("merge") == "true"
        name = scope if merged else f"{scope}{element.findtext('name') or model.get('name')}::"
        place = _pose(element if element.find("pose") is not None else model)
        self.add(model, path.parent, name, (above, place), _version(root), depth + 1)

    def done(self) -> Robot:
        """Return the robot. Where no link has a `visual`, its collision surfaces are taken."""
        visual = (
            "visual"
            if any(link.find("visual") is not None for _, link, _ in self.links)
            else "collision"
        )
        for name, link, base in self.links:
            self.robot.surfaces[name] = [
                self.files.shown(
                    _geometry(view.find("geometry"), base, self.files),
                    portable.product(self.place(name), _pose(view)),
                )
                for view in link.findall(visual)
            ]
        for name, scope, ends, joint, axis, frame, limits in self.joints:
            parent, child = (
                scope + end if scope + end in self.robot.surfaces else end for end in ends
            )
            if joint.get("type") not in ("revolute", "continuous"):
                self.robot.fixed.append((parent, child))
                continue
            hinge = self.place(f"{name} joint")[:3, 3]
            turned = portable.applied(self.place(frame)[:3, :3], axis)
            limits = (None, None) if joint.get("type") == "continuous" else limits
            self.robot.turns(name, (parent, child), hinge, turned, limits)
        return self.robot


def _used(element: Element) -> Iterator[Element]:
    """Yield an element and the elements below it, except those that say nothing about shapes and
    joints.
    """
    yield element
    for child in element:
        if child.tag not in UNUSED:
            yield from _used(child)


def is_description(path: Path) -> bool:
    """Return whether a file's name is that of a robot's description or of a template of one."""
    return path.suffix.lower() in (*KINDS, *TEMPLATES)


def read_robot(path: Path, inputs: Path) -> Robot:
    """Return the robot that a URDF, SDF or MJCF file describes; its files are looked for inside the
    folder `inputs`.

    Raises: InputError naming the file and the reason: a template, no such description, a file of it
    that is missing or lies outside, a number that is none, no surface.
    """
    if path.suffix.lower() in TEMPLATES:
        how = TEMPLATES[path.suffix.lower()].replace("FILE", path.name)
        raise InputError(f"{path}: is a template, expected what it expands to: {how}")
    files = Files(inputs)
    links = _Links(files)
    readers = {
        "robot": links.urdf,
        "sdf": links.sdf,
        "gazebo": links.sdf,
        "mujoco": partial(mjcf, files=files),
    }
    with reading(path, "description"):
        root = files.parsed(path)
        if root.tag not in readers:
            raise ValueError(f"<{root.tag}>, expected one of {sorted(readers)}")
        if any(
            "xacro" in item.tag or re.search(r"\$[{(]|\{\{", str(item.attrib))
            for item in _used(root)
        ):
            raise ValueError(
                f"it holds macros, expected what they expand to: {TEMPLATES['.xacro']}"
            )
        robot = readers[root.tag](root, path.resolve().parent)
    surfaces = [triangles for of_link in robot.surfaces.values() for triangles in of_link]
    if not sum(map(len, surfaces)) or not all(
        np.isfinite(triangles).all() for triangles in surfaces
    ):
        raise InputError(
            f"{path}: no surface of finite places, expected links with visual geometry"
        )
    return robot
