"""Reading URDF and SDF: links, poses, units, surfaces and joints.

Nothing outside the folder of inputs is opened.
Sources: ROS, urdf/XML (link, joint); SDFormat 1.4 to 1.11 and its proposal on pose frames. MJCF is
read in `robot_mjcf`. yourdfpy reads URDF alone; the three formats share what is in
`robot_geometry`.
"""

import itertools
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from lowalt.extensions.drafting.robot_geometry import (
    DEEPEST,
    Files,
    Robot,
    numbers,
    pose_of,
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
"""Elements that say nothing about shapes and joints, so that macros in them do no harm."""


class _DescribedJoint(NamedTuple):
    """A joint as a file states it.

    name, ends: scoped name, names of the parent's and the child's link; scope: ends in :: where it
    has a name; axis: (3,) in `frame`; limits: texts of lower and upper, None where not stated.
    """

    name: str
    scope: str
    ends: list[str]
    element: Element
    axis: np.ndarray
    frame: str
    limits: tuple[str | None, str | None]


def _geometry(element: Element | None, base: Path, files: Files) -> np.ndarray:
    """Return the triangles (K, 3, 3) of a `geometry` of URDF or SDF.

    Planes and unknown shapes have none.
    """
    if element is None:
        return np.zeros((0, 3, 3))
    for shape in element:
        values = {**shape.attrib, **{child.tag: child.text or "" for child in shape}}
        if shape.tag == "mesh":
            scale = numbers(values.get("scale"), 3, (1, 1, 1))
            file = values.get("filename", values.get("uri", ""))
            triangles = files.mesh(file, base, scale, shape.findtext("submesh/name"))
            if shape.findtext("submesh/center") in ("1", "true") and len(triangles):
                low = triangles.min(axis=(0, 1))
                high = triangles.max(axis=(0, 1))
                triangles = triangles - (low + high) / 2
            return triangles
        if shape.tag == "box":
            return primitive("box", numbers(values.get("size"), 3, ()))
        if shape.tag in ("cylinder", "capsule"):
            sizes = np.array([float(values["radius"]), float(values["length"])])
            return primitive(shape.tag, sizes)
        if shape.tag in ("sphere", "ellipsoid"):
            return primitive(shape.tag, numbers(values.get("radius", values.get("radii")), 3, ()))
    return np.zeros((0, 3, 3))


def _pose(element: Element) -> np.ndarray:
    """The pose (4, 4) that an element has in its `pose` (SDF) or its `origin` (URDF)."""
    origin = element.find("origin")
    if origin is not None:
        shift = numbers(origin.get("xyz"), 3, (0, 0, 0))
        angles = numbers(origin.get("rpy"), 3, (0, 0, 0))
        return pose_of(shift, Rotation.from_euler("xyz", angles))
    pose = element.find("pose")
    if pose is None or not (pose.text or "").strip():
        return np.eye(4)
    if pose.get("rotation_format") == "quat_xyzw":
        values = numbers(pose.text, 7, ())
        turn = Rotation.from_quat(values[3:])
    else:
        values = numbers(pose.text, 6, ())
        degrees = pose.get("degrees") == "true"
        turn = Rotation.from_euler("xyz", values[3:], degrees=degrees)
    return pose_of(values[:3], turn)


def _version(root: Element) -> tuple[int, ...]:
    """Return the version of an SDF file as integers, since 1.10 comes after 1.9."""
    return tuple(int(number) for number in root.get("version", "1.5").split("."))


def _axis_frame(joint: Element, version: tuple[int, ...], own: str, model: str, scope: str) -> str:
    """Return the frame in which the axis of an SDF joint is given.

    It is the joint's `own`, the model's or a named one. Before version 1.5 it is the model's, from
    1.5 to 1.6 where `use_parent_model_frame` says so, from 1.7 on the one that `expressed_in`
    names.
    """
    named = None
    along = joint.find("axis/xyz")
    if along is not None:
        named = along.get("expressed_in")
    in_model = version < (1, 7) and joint.findtext("axis/use_parent_model_frame") in ("1", "true")
    if version < (1, 5) or in_model or named == "__model__":
        return model
    if named:
        return scope + named
    return own


def _sdf_joint(
    element: Element, name: str, scope: str, ends: list[str], frame: str
) -> _DescribedJoint:
    """A joint of an SDF, whose axis is given in a frame."""
    axis = numbers(element.findtext("axis/xyz"), 3, (0, 0, 1))
    limits = (element.findtext("axis/limit/lower"), element.findtext("axis/limit/upper"))
    return _DescribedJoint(name, scope, ends, element, axis, frame, limits)


def _link_name(joint: Element, end: str) -> str:
    """The link that a joint of a URDF names as its parent or child."""
    element = joint.find(end)
    name = None if element is None else element.get("link")
    if name is None:
        raise ValueError(f"joint {joint.get('name')!r} names no {end}")
    return name


class _Links:
    """Links and joints by scoped name, whose frames each have a pose in another frame.

    Poses are resolved at the end.
    """

    def __init__(self, files: Files) -> None:
        self.files = files
        self.robot = Robot()
        self.frames: dict[str, tuple[str, np.ndarray]] = {"": ("", np.eye(4))}
        self.links: list[tuple[str, Element, Path]] = []
        self.joints: list[_DescribedJoint] = []

    def pose(self, frame: str, depth: int = 0) -> np.ndarray:
        """The pose (4, 4) of a frame."""
        if frame == "":
            return np.eye(4)
        if frame not in self.frames:
            raise ValueError(f"frame {frame!r} is unknown")
        # A joint of a URDF is a frame between two links.
        if depth > 2 * DEEPEST:
            raise ValueError(f"frame {frame!r} hangs on itself, or is deeper than {DEEPEST} links")
        above, in_above = self.frames[frame]
        return portable.product(self.pose(above, depth + 1), in_above)

    def urdf(self, root: Element, base: Path) -> Robot:
        """The robot of a URDF: a joint stands on its parent, and its child in it."""
        for link in root.findall("link"):
            name = link.get("name", "")
            self.frames[name] = ("", np.eye(4))
            self.links.append((name, link, base))
        for joint in root.findall("joint"):
            parent = _link_name(joint, "parent")
            child = _link_name(joint, "child")
            name = joint.get("name", child)
            frame = f"{name} joint"
            # The parent may be the world, which need not be a link.
            self.frames.setdefault(parent, ("", np.eye(4)))
            self.frames[frame] = (parent, _pose(joint))
            self.frames[child] = (frame, np.eye(4))
            axis = np.array([1.0, 0.0, 0.0])
            along = joint.find("axis")
            if along is not None:
                axis = numbers(along.get("xyz"), 3, (1, 0, 0))
            limits: tuple[str | None, str | None] = (None, None)
            limit = joint.find("limit")
            if limit is not None:
                limits = (limit.get("lower", "0"), limit.get("upper", "0"))
            self.joints.append(
                _DescribedJoint(name, "", [parent, child], joint, axis, frame, limits)
            )
        return self.done()

    def sdf(self, root: Element, base: Path) -> Robot:
        """The robot of an SDF: its model, or the only one of its world."""
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
        pose: tuple[str, np.ndarray],
        version: tuple[int, ...],
        depth: int,
    ) -> None:
        """Add the links, frames, joints and inner models of an SDF.

        scope: ends in :: where it has a name; pose: the model's frame above it, and its pose there.
        """
        if depth > DEEPEST:
            raise ValueError("models in a circle")
        # Several merged models have one scope.
        inner = f"{scope}__model__ {len(self.frames)}"
        self.frames[inner] = pose

        def placed(element: Element, default: str) -> tuple[str, np.ndarray]:
            """The frame that an element's pose is relative to, and its pose there."""
            frame = default
            stated = element.find("pose")
            if stated is not None and stated.get("relative_to"):
                frame = scope + stated.get("relative_to", "")
                if stated.get("relative_to") == "__model__":
                    frame = inner
            return frame, _pose(element)

        for child in model:
            name = scope + child.get("name", "")
            if child.tag == "link":
                # A link takes the name over from a joint of that name.
                self.frames[name] = placed(child, inner)
                self.links.append((name, child, base))
            elif child.tag == "frame":
                attached = child.get("attached_to")
                self.frames[name] = placed(child, scope + attached if attached else inner)
            elif child.tag == "joint":
                ends = [(child.findtext(end) or "").strip() for end in ("parent", "child")]
                own = f"{name} joint"  # links and joints of one name are told apart
                self.frames[own] = placed(child, scope + ends[1])
                self.frames.setdefault(name, (own, np.eye(4)))
                frame = _axis_frame(child, version, own, inner, scope)
                self.joints.append(_sdf_joint(child, name, scope, ends, frame))
            elif child.tag == "plugin":
                self.sense(child, scope)
            elif child.tag == "model":
                self.add(child, base, f"{name}::", placed(child, inner), version, depth + 1)
            elif child.tag == "include":
                self.include(child, base, scope, placed(child, inner)[0], depth)

    def sense(self, plugin: Element, scope: str) -> None:
        """Take the sense of a rotor from a plugin that states one."""
        joint = plugin.findtext("jointName")
        turn = plugin.findtext("turningDirection")
        if joint and turn:
            self.robot.senses[scope + joint.strip()] = turn.strip()

    def include(self, element: Element, base: Path, scope: str, above: str, depth: int) -> None:
        """Take the model that an element `include` names."""
        uri = (element.findtext("uri") or "").strip()
        if "/" not in uri and not (base / uri).exists():
            # Gazebo looks for such a name among its models.
            uri = f"model://{uri}"
        path = self.files.find(uri, base)
        if path.is_dir():
            file = "model.sdf"
            config = path / "model.config"
            if config.exists():
                file = self.files.parsed(config).findtext("sdf") or file
            path = self.files.find(file.strip(), path)
        root = self.files.parsed(path)
        model = root.find("model")
        if model is None:
            raise ValueError(f"{path.name} holds no model")
        inner_scope = scope
        if element.get("merge") != "true":
            inner_scope = f"{scope}{element.findtext('name') or model.get('name')}::"
        stated = element if element.find("pose") is not None else model
        pose = (above, _pose(stated))
        self.add(model, path.parent, inner_scope, pose, _version(root), depth + 1)

    def done(self) -> Robot:
        """Return the robot. Where no link has a `visual`, its collision surfaces are taken."""
        surface = "collision"
        if any(link.find("visual") is not None for _, link, _ in self.links):
            surface = "visual"
        for name, link, base in self.links:
            self.robot.surfaces[name] = []
            for view in link.findall(surface):
                triangles = _geometry(view.find("geometry"), base, self.files)
                pose = portable.product(self.pose(name), _pose(view))
                self.robot.surfaces[name].append(self.files.shown(triangles, pose))
        for joint in self.joints:
            parent, child = (self._link(joint.scope, end) for end in joint.ends)
            kind = joint.element.get("type")
            if kind not in ("revolute", "continuous"):
                self.robot.fixed.append((parent, child))
                continue
            hinge = self.pose(f"{joint.name} joint")[:3, 3]
            axis = portable.applied(self.pose(joint.frame)[:3, :3], joint.axis)
            limits = (None, None) if kind == "continuous" else joint.limits
            self.robot.turns(joint.name, (parent, child), hinge, axis, limits)
        return self.robot

    def _link(self, scope: str, name: str) -> str:
        """The scoped name of a link that a joint names, as it is where its scope has none."""
        if scope + name in self.robot.surfaces:
            return scope + name
        return name


def _used(element: Element) -> Iterator[Element]:
    """Yield an element and those below it, except for UNUSED ones."""
    yield element
    for child in element:
        if child.tag not in UNUSED:
            yield from _used(child)


def is_description(path: Path) -> bool:
    """Return whether a file's name is that of a robot's description or of a template of one."""
    return path.suffix.lower() in (*KINDS, *TEMPLATES)


def read_robot(path: Path, inputs: Path) -> Robot:
    """Return the robot that a URDF, SDF or MJCF file describes.

    Its files are looked for inside the folder `inputs`. Raises: InputError naming the file and the
    reason: a template, no such description, a file of it that is missing or lies outside, a number
    that is none, no surface.
    """
    if path.suffix.lower() in TEMPLATES:
        how = TEMPLATES[path.suffix.lower()].replace("FILE", path.name)
        raise InputError(f"{path}: is a template, expected what it expands to: {how}")
    files = Files(inputs)
    links = _Links(files)
    readers: dict[str, Callable[[Element, Path], Robot]] = {
        "robot": links.urdf,
        "sdf": links.sdf,
        "gazebo": links.sdf,
        "mujoco": partial(mjcf, files=files),
    }
    with reading(path, "description"):
        root = files.parsed(path)
        if root.tag not in readers:
            raise ValueError(f"<{root.tag}>, expected one of {sorted(readers)}")
        for item in _used(root):
            if "xacro" in item.tag or re.search(r"\$[{(]|\{\{", str(item.attrib)):
                raise ValueError(
                    f"it holds macros, expected what they expand to: {TEMPLATES['.xacro']}"
                )
        robot = readers[root.tag](root, path.resolve().parent)
    surfaces = list(itertools.chain.from_iterable(robot.surfaces.values()))
    finite = all(np.isfinite(triangles).all() for triangles in surfaces)
    if not finite or not sum(map(len, surfaces)):
        raise InputError(
            f"{path}: no surface of finite places, expected links with visual geometry"
        )
    return robot
