"""Reading MJCF: bodies, classes of defaults, geoms and hinges. Source: MuJoCo, XML reference."""

import math
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from lowalt.extensions.drafting.guesses import TURNING
from lowalt.extensions.drafting.robot_geometry import (
    DEEPEST,
    Files,
    Robot,
    direction,
    numbers,
    pose_of,
    primitive,
    shown,
)
from lowalt.numerics import portable

LAST_SHOWN_GROUP = 2
"""Viewers show geoms of the groups 0 to 2."""


def _clear(values: dict[str, str]) -> bool:
    """Return whether a colour is fully transparent."""
    return values.get("rgba", "1").split()[3:] == ["0"]


class _Mjcf:
    """A robot of MJCF. `values` are an element's attributes over those of its class."""

    def __init__(self, root: Element, base: Path, files: Files) -> None:
        self.root = root
        self.base = base
        self.files = files
        self.robot = Robot()
        self.defaults: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        compiler: dict[str, str] = {}
        for element in root.iter("compiler"):
            compiler |= element.attrib
        self.degrees = compiler.get("angle", "degree") == "degree"
        self.order = compiler.get("eulerseq", "xyz")
        for default in root.findall("default"):
            self.default(default, "main", {})
        folder = compiler.get("meshdir", compiler.get("assetdir", "."))
        self.meshes = {}
        for mesh in root.findall("asset/mesh"):
            values = self.values(mesh, "")
            if "file" in values:
                name = values.get("name", Path(values["file"]).stem)
                self.meshes[name] = (f"{folder}/{values['file']}", values)
        self.hidden = set()
        for material in root.findall("asset/material"):
            if _clear(material.attrib):
                self.hidden.add(material.get("name"))

    def default(self, element: Element, name: str, above: dict) -> None:
        """Take the defaults of a class and of those inside it."""
        of_class = {tag: dict(values) for tag, values in above.items()}
        self.defaults[name] = of_class
        for child in element:
            if child.tag != "default":
                of_class[child.tag] = of_class.get(child.tag, {}) | child.attrib
        for child in element.findall("default"):
            self.default(child, child.get("class", ""), of_class)

    def values(self, element: Element, childclass: str) -> dict[str, str]:
        """An element's attributes over those of its class."""
        of_class = self.defaults.get(
            element.get("class") or childclass or "main", self.defaults["main"]
        )
        return of_class.get(element.tag, {}) | element.attrib

    def pose(self, values: dict[str, str]) -> np.ndarray:
        """The pose (4, 4) of a body or geom."""
        turn = Rotation.identity()
        if "quat" in values:
            turn = Rotation.from_quat(numbers(values["quat"], 4, ()), scalar_first=True)
        elif "euler" in values:
            # Small letters turn with the body, which are scipy's capitals.
            turn = Rotation.from_euler(
                self.order.swapcase(), numbers(values["euler"], 3, ()), degrees=self.degrees
            )
        elif "axisangle" in values:
            *axis, angle = numbers(values["axisangle"], 4, ())
            turn = Rotation.from_rotvec(direction(np.array(axis)) * angle, degrees=self.degrees)
        elif "zaxis" in values:
            turn = Rotation.align_vectors([numbers(values["zaxis"], 3, ())], [[0, 0, 1]])[0]
        elif "xyaxes" in values:
            x, y = numbers(values["xyaxes"], 6, ()).reshape(2, 3)
            x = direction(x)
            y = direction(y - x * portable.dot(x, y))
            turn = Rotation.from_matrix(np.stack([x, y, np.cross(x, y)], axis=1))
        return pose_of(numbers(values.get("pos"), 3, (0, 0, 0)), turn)

    def geom(self, values: dict[str, str], above: np.ndarray) -> np.ndarray:
        """Return the triangles (K, 3, 3) of a geom that viewers show.

        Viewers show groups 0 to 2, and nothing transparent; planes have no triangles either.
        """
        usual = "mesh" if "mesh" in values else "sphere"
        kind = values.get("type", usual)
        clear = _clear(values) or values.get("material") in self.hidden
        group = int(values.get("group", "0"))
        if group > LAST_SHOWN_GROUP or clear or kind in ("plane", "hfield", "sdf"):
            return np.zeros((0, 3, 3))
        pose = self.pose(values)
        if kind == "mesh":
            if values.get("mesh") not in self.meshes:
                raise ValueError(f"mesh {values.get('mesh')!r} is no asset")
            file, asset = self.meshes[values["mesh"]]
            triangles = self.files.mesh(file, self.base, numbers(asset.get("scale"), 3, (1, 1, 1)))
        else:
            size = np.array([float(word) for word in values.get("size", "").split()])
            if "fromto" in values:
                ends = numbers(values["fromto"], 6, ()).reshape(2, 3)
                along = ends[1] - ends[0]
                size = np.array([size[0], portable.norm(along) / 2])
                turn, _ = Rotation.align_vectors([along], [[0, 0, 1]])
                pose = pose_of(ends.mean(axis=0), turn)
            # Lengths are halves in MJCF.
            if kind == "box":
                whole = 2 * size
            elif kind == "sphere":
                whole = size[:1]
            elif kind == "ellipsoid":
                whole = size
            else:
                whole = size * [1, 2]
            triangles = primitive(kind, whole)
        return self.files.shown(triangles, portable.product(above, pose))

    def body(
        self, element: Element, parent: str, above: np.ndarray, childclass: str, depth: int
    ) -> None:
        """Take a body and those inside it."""
        if depth > DEEPEST:
            raise ValueError(f"bodies deeper than {DEEPEST}")
        name = element.get("name") or f"body {len(self.robot.surfaces)}"
        childclass = element.get("childclass", childclass)
        here = portable.product(above, self.pose(element.attrib))
        self.robot.surfaces[name] = []
        for geom in element.findall("geom"):
            values = self.values(geom, childclass)
            own_name = values.get("name", "")
            owner = name
            if TURNING["rotor"].search(own_name) or TURNING["wheel"].search(own_name):
                # A geom that its name calls a rotor or a wheel is a link, fixed to its body.
                owner = own_name
            self.robot.surfaces.setdefault(owner, []).append(self.geom(values, here))
            if owner != name:
                self.robot.fixed.append((name, owner))
        if parent:
            self.joint(element, parent, name, here, childclass)
        for child in element.findall("body"):
            self.body(child, name, here, childclass, depth + 1)

    def joint(
        self, element: Element, parent: str, name: str, here: np.ndarray, childclass: str
    ) -> None:
        """Take the last hinge of a body, or fix the body to its parent; here: its pose (4, 4)."""
        joints = [self.values(joint, childclass) for joint in element.findall("joint")]
        hinges = [values for values in joints if values.get("type", "hinge") == "hinge"]
        if not hinges:
            self.robot.fixed.append((parent, name))
            return
        values = hinges[-1]
        limits: tuple[str | None, str | None] = (None, None)
        if "range" in values and values.get("limited") != "false":
            low, high = values["range"].split()
            if self.degrees:
                low = str(math.radians(float(low)))
                high = str(math.radians(float(high)))
            limits = (low, high)
        hinge = shown(numbers(values.get("pos"), 3, (0, 0, 0)), here)
        axis = portable.applied(here[:3, :3], numbers(values.get("axis"), 3, (0, 0, 1)))
        self.robot.turns(values.get("name", name), (parent, name), hinge, axis, limits)


def mjcf(root: Element, base: Path, files: Files) -> Robot:
    """Return the robot of an MJCF file in the folder `base`.

    The world's own geoms, such as floors, are left out. Raises: InputError for files that are
    missing or outside; other exceptions for a damaged description.
    """
    for include in root.findall("include"):
        root.extend(files.parsed(files.find(include.get("file", ""), base)))
    reader = _Mjcf(root, base, files)
    for body in root.findall("worldbody/body"):
        reader.body(body, "", np.eye(4), "", 0)
    return reader.robot
