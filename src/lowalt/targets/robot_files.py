"""Reading URDF, SDF and MJCF: links, poses, units, surfaces and joints; nothing outside the folder of inputs is opened.

Sources: ROS, urdf/XML (link, joint); SDFormat 1.4 to 1.11 and its proposal on pose frames; MuJoCo, XML reference.
yourdfpy reads URDF alone; the three formats share what is here, so they share its checks of paths and sizes.
"""

import math
import re
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.targets.robot_geometry import Files, direction, numbers, place_of, primitive, shown
from lowalt.targets.robots import Joint, Robot

KINDS = (".urdf", ".sdf", ".xml", ".mjcf", ".world")
TEMPLATES = {
    ".xacro": "xacro FILE > robot.urdf", ".jinja": "the project's own script (PX4: jinja_gen.py FILE)",
    ".erb": "erb FILE > robot.sdf",
}  # fmt: skip
"""Templates of descriptions by suffix, and what expands them."""
DEEPEST = 50
"""Most links, frames or models that hang on one another."""
MOST_TURN = 4 * math.pi
"""A joint whose range is larger turns without end: a rotor or a wheel."""


def _geometry(element: Element | None, base: Path, files: Files) -> np.ndarray:
    """Triangles (K, 3, 3) of a `geometry` of URDF or SDF; planes and what is unknown have none."""
    for shape in element if element is not None else ():
        told = {**shape.attrib, **{child.tag: child.text or "" for child in shape}}
        if shape.tag == "mesh":
            scale, part = numbers(told.get("scale"), 3, (1, 1, 1)), shape.findtext("submesh/name")
            found = files.mesh(told.get("filename", told.get("uri", "")), base, scale, part)
            if shape.findtext("submesh/center") in ("1", "true") and len(found):
                found = found - (found.min(axis=(0, 1)) + found.max(axis=(0, 1))) / 2
            return found
        if shape.tag == "box":
            return primitive("box", numbers(told.get("size"), 3, ()))
        if shape.tag in ("cylinder", "capsule"):
            return primitive(shape.tag, np.array([float(told["radius"]), float(told["length"])]))
        if shape.tag in ("sphere", "ellipsoid"):
            return primitive(shape.tag, numbers(told.get("radius", told.get("radii")), 3, ()))
    return np.zeros((0, 3, 3))


def _endless(kind: str, low: str | None, high: str | None) -> bool:
    """Whether a joint of a kind turns without end: it has no limits, or wide ones."""
    return kind == "continuous" or not (low and high) or float(high) - float(low) > MOST_TURN


def _urdf(root: Element, base: Path, files: Files) -> Robot:
    """A robot of URDF."""

    def origin(element: Element | None) -> np.ndarray:
        """The place (4, 4) of an element `origin`."""
        told = element.attrib if element is not None else {}
        turn = Rotation.from_euler("xyz", numbers(told.get("rpy"), 3, (0, 0, 0)))
        return place_of(numbers(told.get("xyz"), 3, (0, 0, 0)), turn)

    robot, hung = Robot(), {}
    for joint in root.findall("joint"):
        hung[joint.find("child").get("link")] = (joint.find("parent").get("link"), joint)

    def place(link: str, depth: int = 0) -> np.ndarray:
        """The place (4, 4) of a link."""
        if link not in hung:
            return np.eye(4)
        if depth > DEEPEST:
            raise ValueError(f"joints in a circle or deeper than {DEEPEST}")
        return portable.product(place(hung[link][0], depth + 1), origin(hung[link][1].find("origin")))

    visual = "visual" if root.find("link/visual") is not None else "collision"
    for link in root.findall("link"):
        name = link.get("name", "")
        robot.surfaces[name] = [
            shown(_geometry(one.find("geometry"), base, files),
                   portable.product(place(name), origin(one.find("origin"))))
            for one in link.findall(visual)
        ]  # fmt: skip
    for child, (parent, joint) in hung.items():
        kind, limit, here = joint.get("type", ""), joint.find("limit"), place(child)
        if kind not in ("continuous", "revolute"):
            robot.fixed.append((parent, child))
            continue
        along = joint.find("axis")
        axis = numbers(along.get("xyz") if along is not None else None, 3, (1, 0, 0))
        ends = (limit.get("lower", "0"), limit.get("upper", "0")) if limit is not None else (None, None)
        turned = direction(portable.applied(here[:3, :3], axis))
        robot.joints.append(Joint(joint.get("name", child), parent, child, here[:3, 3], turned, _endless(kind, *ends)))
    return robot


class _Sdf:
    """A model of SDF: frames by scoped name, each a place in another frame, resolved when they are asked for."""

    def __init__(self, files: Files) -> None:
        self.files, self.robot = files, Robot()
        self.frames: dict[str, tuple[str, np.ndarray]] = {"": ("", np.eye(4))}
        self.links: list[tuple[str, Element, Path]] = []
        self.jointed: list[tuple[str, str, Element, str, bool]] = []

    def place(self, frame: str, depth: int = 0) -> np.ndarray:
        """The place (4, 4) of a frame."""
        if frame == "":
            return np.eye(4)
        if depth > DEEPEST or frame not in self.frames:
            raise ValueError(f"frame {frame!r} is unknown or hangs on itself")
        above, own = self.frames[frame]
        return portable.product(self.place(above, depth + 1), own)

    @staticmethod
    def pose(element: Element | None) -> np.ndarray:
        """The place (4, 4) of an element's `pose`."""
        pose = element.find("pose") if element is not None else None
        if pose is None or not (pose.text or "").strip():
            return np.eye(4)
        quat = pose.get("rotation_format") == "quat_xyzw"
        values = numbers(pose.text, 7 if quat else 6, ())
        degrees = pose.get("degrees") == "true"
        turn = Rotation.from_quat(values[3:]) if quat else Rotation.from_euler("xyz", values[3:], degrees=degrees)
        return place_of(values[:3], turn)

    def add(self, model: Element, base: Path, scope: str, place: tuple[str, np.ndarray], old: bool, depth: int) -> None:
        """Take the links, frames, joints and inner models of a model; `scope` ends in :: where it has a name."""
        if depth > DEEPEST:
            raise ValueError("models in a circle")
        inner = f"{scope}__model__ {len(self.frames)}"  # of merged models several have one scope
        self.frames[inner] = place

        def above(element: Element, default: str) -> str:
            """The frame that an element's pose is relative to."""
            pose = element.find("pose")
            name = pose.get("relative_to", "") if pose is not None else ""
            return inner if name == "__model__" else scope + name if name else default

        for child in model:
            name = scope + child.get("name", "")
            if child.tag == "link":
                self.frames[name] = (above(child, inner), self.pose(child))  # over a joint of that name
                self.links.append((name, child, base))
            elif child.tag == "frame":
                attached = child.get("attached_to")
                self.frames[name] = (above(child, scope + attached if attached else inner), self.pose(child))
            elif child.tag == "joint":
                frame = f"{name} joint"  # links and joints of one name are told apart
                self.frames[frame] = (above(child, scope + (child.findtext("child") or "").strip()), self.pose(child))
                self.frames.setdefault(name, (frame, np.eye(4)))
                self.jointed.append((name, scope, child, inner, old))
            elif child.tag == "plugin" and child.findtext("jointName") and child.findtext("turningDirection"):
                joint, turn = (child.findtext(word, "").strip() for word in ("jointName", "turningDirection"))
                self.robot.senses[scope + joint] = turn
            elif child.tag == "model":
                self.add(child, base, f"{name}::", (above(child, inner), self.pose(child)), old, depth + 1)
            elif child.tag == "include":
                self.include(child, base, scope, above(child, inner), depth)

    def include(self, element: Element, base: Path, scope: str, above: str, depth: int) -> None:
        """Take the model that an element `include` names."""
        uri = (element.findtext("uri") or "").strip()
        named = "/" not in uri and not (base / uri).exists()  # Gazebo looks for such a name among its models
        folder = self.files.find(f"model://{uri}" if named else uri, base)
        path = folder
        if folder.is_dir():
            config = folder / "model.config"
            listed = self.files.parsed(config).findtext("sdf") if config.exists() else None
            path = self.files.find((listed or "model.sdf").strip(), folder)
        root = self.files.parsed(path)
        model = root.find("model")
        if model is None:
            raise ValueError(f"{path.name} holds no model")
        merged = element.get("merge") == "true"
        name = scope if merged else f"{scope}{element.findtext('name') or model.get('name')}::"
        own = self.pose(element if element.find("pose") is not None else model)
        self.add(model, path.parent, name, (above, own), _old(root), depth + 1)

    def done(self) -> Robot:
        """The robot of all that was taken."""
        visual = "visual" if any(link.find("visual") is not None for _, link, _ in self.links) else "collision"
        for name, link, base in self.links:
            self.robot.surfaces[name] = [
                shown(_geometry(one.find("geometry"), base, self.files),
                       portable.product(self.place(name), self.pose(one)))
                for one in link.findall(visual)
            ]  # fmt: skip
        for name, scope, joint, inner, old in self.jointed:
            ends = [(joint.findtext(end) or "").strip() for end in ("parent", "child")]
            parent, child = (scope + end if scope + end in self.robot.surfaces else end for end in ends)
            if joint.get("type") not in ("revolute", "continuous"):
                self.robot.fixed.append((parent, child))
                continue
            axis = joint.find("axis")
            told = axis.find("xyz") if axis is not None else None
            along = numbers(told.text if told is not None else None, 3, (0, 0, 1))
            outer = old or (axis is not None and axis.findtext("use_parent_model_frame") in ("1", "true"))
            within = told.get("expressed_in") if told is not None else None
            frame = inner if outer or within == "__model__" else scope + within if within else f"{name} joint"
            turned = direction(portable.applied(self.place(frame)[:3, :3], along))
            low, high = (joint.findtext(f"axis/limit/{end}") for end in ("lower", "upper"))
            here = self.place(f"{name} joint")[:3, 3]
            self.robot.joints.append(Joint(name, parent, child, here, turned, _endless(joint.get("type"), low, high)))
        return self.robot


def _old(root: Element) -> bool:
    """Whether a file is of SDF before 1.5, whose axes are in the model's frame."""
    return float(root.get("version", "1.5")) < 1.45


def _sdf(root: Element, base: Path, files: Files) -> Robot:
    """A robot of SDF: the model, or the only one of a world."""
    found = [*root.findall("model"), *root.findall("world/model")]
    if len(found) != 1:
        raise ValueError(f"{len(found)} models, expected one")
    sdf = _Sdf(files)
    # The model's own pose is its place in a world, which does not count.
    sdf.add(found[0], base, "", ("", np.eye(4)), _old(root), 0)
    return sdf.done()


def _clear(told: dict[str, str]) -> bool:
    """Whether a colour of MJCF lets all light through."""
    return told.get("rgba", "1").split()[3:] == ["0"]


class _Mjcf:
    """A robot of MJCF."""

    def __init__(self, root: Element, base: Path, files: Files) -> None:
        self.root, self.base, self.files, self.robot = root, base, files, Robot()
        self.defaults: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        self.compiler: dict[str, str] = {}
        for compiler in root.iter("compiler"):
            self.compiler |= compiler.attrib
        for default in root.findall("default"):
            self.default(default, "main", {})
        self.meshes = {}
        folder = self.compiler.get("meshdir", self.compiler.get("assetdir", "."))
        for mesh in root.findall("asset/mesh"):
            told = self.told(mesh, "")
            if "file" in told:
                self.meshes[told.get("name", Path(told["file"]).stem)] = (f"{folder}/{told['file']}", told)
        self.hidden = {one.get("name") for one in root.findall("asset/material") if _clear(one.attrib)}

    def default(self, element: Element, name: str, above: dict) -> None:
        """Take the defaults of a class and of those inside it."""
        own = self.defaults[name] = {tag: dict(values) for tag, values in above.items()}
        for child in element:
            if child.tag != "default":
                own[child.tag] = own.get(child.tag, {}) | child.attrib
        for child in element.findall("default"):
            self.default(child, child.get("class", ""), own)

    def told(self, element: Element, childclass: str) -> dict[str, str]:
        """An element's attributes over those of its class."""
        chosen = self.defaults.get(element.get("class") or childclass or "main", self.defaults["main"])
        return chosen.get(element.tag, {}) | element.attrib

    def place(self, told: dict[str, str]) -> np.ndarray:
        """The place (4, 4) of a body or geom."""
        degrees, turn = self.compiler.get("angle", "degree") == "degree", Rotation.identity()
        if "quat" in told:
            turn = Rotation.from_quat(numbers(told["quat"], 4, ())[[1, 2, 3, 0]])
        elif "euler" in told:
            order = self.compiler.get("eulerseq", "xyz")
            order = order.upper() if order.islower() else order.lower()  # small letters turn with the body
            turn = Rotation.from_euler(order, numbers(told["euler"], 3, ()), degrees=degrees)
        elif "axisangle" in told:
            *axis, angle = numbers(told["axisangle"], 4, ())
            turn = Rotation.from_rotvec(direction(np.array(axis)) * (np.radians(angle) if degrees else angle))
        elif "xyaxes" in told or "zaxis" in told:
            given = numbers(told.get("xyaxes", told.get("zaxis")), 6 if "xyaxes" in told else 3, ())
            if "zaxis" in told:
                turn = Rotation.align_vectors([given], [[0, 0, 1]])[0]
            else:
                x = direction(given[:3])
                y = direction(given[3:] - x * portable.dot(x, given[3:]))
                turn = Rotation.from_matrix(np.stack([x, y, np.cross(x, y)], axis=1))
        return place_of(numbers(told.get("pos"), 3, (0, 0, 0)), turn)

    def geom(self, told: dict[str, str], place: np.ndarray) -> np.ndarray:
        """Triangles (K, 3, 3) of a geom that viewers show: groups 0 to 2, not transparent, no plane."""
        kind = told.get("type", "mesh" if "mesh" in told else "sphere")
        clear = _clear(told) or told.get("material") in self.hidden
        if int(told.get("group", "0")) > 2 or clear or kind in ("plane", "hfield", "sdf"):
            return np.zeros((0, 3, 3))
        if kind == "mesh":
            if told.get("mesh") not in self.meshes:
                raise ValueError(f"mesh {told.get('mesh')!r} is no asset")
            file, asset = self.meshes[told["mesh"]]
            found = self.files.mesh(file, self.base, numbers(asset.get("scale"), 3, (1, 1, 1)))
            return shown(found, portable.product(place, self.place(told)))
        size = np.array([float(word) for word in told.get("size", "").split()])
        here = self.place(told)
        if "fromto" in told:
            ends = numbers(told["fromto"], 6, ()).reshape(2, 3)
            size = np.array([size[0], portable.norm(ends[1] - ends[0]) / 2])
            here = place_of(ends.mean(axis=0), Rotation.align_vectors([ends[1] - ends[0]], [[0, 0, 1]])[0])
        if kind == "sphere":
            size = size[:1]
        full = 2 * size if kind == "box" else size * [1, 2] if kind in ("cylinder", "capsule") else size
        return shown(primitive(kind, full), portable.product(place, here))

    def body(self, element: Element, parent: str, above: np.ndarray, childclass: str, depth: int) -> None:
        """Take a body and those inside it."""
        if depth > DEEPEST:
            raise ValueError(f"bodies deeper than {DEEPEST}")
        name = element.get("name") or f"body {len(self.robot.surfaces)}"
        childclass = element.get("childclass", childclass)
        here = portable.product(above, self.place(element.attrib))
        self.robot.surfaces[name] = [self.geom(self.told(geom, childclass), here) for geom in element.findall("geom")]
        joints = [self.told(joint, childclass) for joint in element.findall("joint")] if parent else []
        hinges = [told for told in joints if told.get("type", "hinge") == "hinge"]
        for told in hinges[-1:]:
            hinge = portable.applied(here[:3, :3], numbers(told.get("pos"), 3, (0, 0, 0))) + here[:3, 3]
            axis = direction(portable.applied(here[:3, :3], numbers(told.get("axis"), 3, (0, 0, 1))))
            low, high = told["range"].split() if "range" in told and told.get("limited") != "false" else (None, None)
            if low and self.compiler.get("angle", "degree") == "degree":
                low, high = (str(math.radians(float(end))) for end in (low, high))
            self.robot.joints.append(Joint(told.get("name", name), parent, name, hinge, axis, _endless("", low, high)))
        if parent and not hinges:
            self.robot.fixed.append((parent, name))
        for child in element.findall("body"):
            self.body(child, name, here, childclass, depth + 1)


def _mjcf(root: Element, base: Path, files: Files) -> Robot:
    """A robot of MJCF; the world's own geoms (floors) are left."""
    for include in root.findall("include"):
        root.extend(files.parsed(files.find(include.get("file", ""), base)))
    mjcf = _Mjcf(root, base, files)
    for body in root.findall("worldbody/body"):
        mjcf.body(body, "", np.eye(4), "", 0)
    return mjcf.robot


def is_description(path: Path) -> bool:
    """Whether a file's name is that of a robot's description or of a template of one."""
    return path.suffix.lower() in (*KINDS, *TEMPLATES)


def read_robot(path: Path, inputs: Path) -> Robot:
    """Return the robot that a URDF, SDF or MJCF file describes; its files are looked for inside the folder `inputs`.

    Raises: InputError naming the file and the reason: a template, no such description, a file of it that is missing or
    lies outside, a number that is none, no surface.
    """
    if path.suffix.lower() in TEMPLATES:
        how = TEMPLATES[path.suffix.lower()].replace("FILE", path.name)
        raise InputError(f"{path}: is a template, expected what it expands to: {how}")
    files = Files(inputs)
    try:
        root = files.parsed(path)
        readers = {"robot": _urdf, "sdf": _sdf, "gazebo": _sdf, "mujoco": _mjcf}
        if root.tag not in readers:
            raise ValueError(f"<{root.tag}>, expected one of {sorted(readers)}")
        if any("xacro" in str(one.tag) or re.search(r"\$[{(]|\{\{", str(one.attrib)) for one in root.iter()):
            raise ValueError(f"it holds macros, expected what they expand to: {TEMPLATES['.xacro']}")
        robot = readers[root.tag](root, path.resolve().parent, files)
    except InputError as error:
        raise InputError(str(error) if str(error).startswith(str(path)) else f"{path}: {error}") from None
    except (ValueError, LookupError, AttributeError, TypeError, ArithmeticError, OSError, RecursionError) as error:
        raise InputError(f"{path}: not a readable description ({type(error).__name__}: {error})") from None
    triangles = [one for found in robot.surfaces.values() for one in found]
    if not sum(map(len, triangles)) or not all(np.isfinite(one).all() for one in triangles):
        raise InputError(f"{path}: no surface of finite places, expected links with visual geometry")
    return robot
