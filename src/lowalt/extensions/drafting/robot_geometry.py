"""What descriptions of robots share: links, joints, files of inputs, surfaces, poses, numbers."""

import math
import os
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from lowalt.files.errors import InputError, warn
from lowalt.numerics import portable
from lowalt.targets.mesh_collada import parsed, stated_metres
from lowalt.targets.mesh_files import selected, suffixes
from lowalt.targets.mesh_polygons import Piece, refuse_many

LARGEST_BYTES = 16 << 20
"""Largest size of a description with all that it includes."""
MOST_FILES = 200
MOST_SEARCHED = 100_000
"""Most files and folders below the folder of inputs that are searched for a package of another
name.
"""
OPTIONAL = re.compile(r"\$\(optenv\s+\w+\s*([^()]*)\)")
"""ROS: the value of an environment variable, or a default where it is not set; the default is
always taken.
"""
DEEPEST = 50
"""Largest depth of a chain of links, frames or models."""
MOST_TURN = 4 * math.pi
"""A joint with a larger range turns without end, as a rotor or a wheel does."""


@dataclass(frozen=True)
class Joint:
    """A joint that turns two links, `endless` or not, about its `hinge` (3,) m and `axis` (3,).

    parent, child: the links.
    """

    name: str
    parent: str
    child: str
    hinge: np.ndarray
    axis: np.ndarray
    endless: bool


@dataclass
class Robot:
    """A description of a robot.

    surfaces: by link, each a list of triangles (K, 3, 3) m; fixed: pairs of links, parent first,
    that do not turn; joints: those that turn; senses: of rotors by joint, seen against the axis.
    """

    surfaces: dict[str, list[np.ndarray]] = field(default_factory=dict)
    fixed: list[tuple[str, str]] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    senses: dict[str, str] = field(default_factory=dict)

    def below(self, link: str, others: Collection[str] = ()) -> list[str]:
        """Return a link and all links below it, except `others` and the links below them."""
        pairs = [*self.fixed, *((joint.parent, joint.child) for joint in self.joints)]
        links = [link]
        for name in links:
            left = {*links, *others}
            links += [child for parent, child in pairs if parent == name and child not in left]
        return links

    def turns(
        self,
        name: str,
        links: tuple[str, str],
        hinge: np.ndarray,
        axis: np.ndarray,
        limits: tuple[str | None, str | None],
    ) -> None:
        """Add a joint that turns two links, parent first.

        It turns without end where it has no limits (rad), or wide ones.
        """
        low, high = limits
        endless = not (low and high) or float(high) - float(low) > MOST_TURN
        self.joints.append(Joint(name, *links, hinge, direction(axis), endless))


def numbers(text: str | None, count: int, default: tuple[float, ...]) -> np.ndarray:
    """Numbers of a text; a single one stands for all.

    Raises: ValueError where they are not `count` finite ones.
    """
    values = np.array(default, float)
    if text:
        values = np.array([float(word) for word in text.split()])
    if len(values) == 1:
        values = np.repeat(values, count)
    if len(values) != count or not np.isfinite(values).all():
        raise ValueError(f"{text!r}, expected {count} finite numbers")
    return values


def pose_of(shift: np.ndarray, turn: Rotation) -> np.ndarray:
    """A pose (4, 4) of a shift (3,) and a turn."""
    pose = np.eye(4)
    pose[:3, :3] = turn.as_matrix()
    pose[:3, 3] = shift
    return pose


class Files:
    """The files of a description inside the folder of inputs, and the surfaces that they hold."""

    def __init__(self, inputs: Path) -> None:
        self.inputs = inputs.resolve()
        self.opened = 0
        self.bytes_left = LARGEST_BYTES
        self.triangles = 0
        # Pieces of meshes by file and part: a description may name one mesh many times.
        self.read: dict[tuple[Path, str | None], list[Piece]] = {}
        # The folders and name of every path below `inputs`, once they are needed.
        self.listed: list[tuple[str, ...]] | None = None

    def find(self, name: str, base: Path) -> Path:
        """Return the file that a description in the folder `base` names.

        The name is relative, package:// or model://.
        """
        scheme, slashes, location = name.strip().partition("://")
        if not slashes or scheme == "file":
            paths = [base / (location or name)]
        elif scheme in ("package", "model"):
            head, _, tail = location.partition("/")
            folders = (base, *base.parents)
            above = [folder for folder in folders if folder.is_relative_to(self.inputs)]
            paths = []
            for folder in above:
                paths += [folder / location, folder / "models" / location]
            paths += [folder / tail for folder in above if folder.name == head]
        else:
            raise InputError(
                f"{name!r} is no file of the folder of inputs, expected a downloaded one"
            )
        paths = [path.resolve() for path in paths]
        inside = [path for path in paths if path.is_relative_to(self.inputs)]
        for path in inside:
            if path.exists():
                return path
        if scheme in ("package", "model"):
            elsewhere = self.elsewhere(name, location)
            if elsewhere is not None:
                return elsewhere
        problem = "is not there" if inside else f"lies outside the folder of inputs {self.inputs}"
        raise InputError(
            f"{name!r} {problem}, expected it inside, by the name that the description has"
        )

    def elsewhere(self, name: str, location: str) -> Path | None:
        """Return the only path below the folder of inputs that ends as a package's `location` does.

        The package's own name may be missing, since a clone often has another name. Return None
        where no path ends so.

        Raises: InputError where several fit. Warns: InputWarning naming the file that is taken.
        """
        if self.listed is None:
            found = islice(self.walked(), MOST_SEARCHED)
            self.listed = [path.relative_to(self.inputs).parts for path in found]
        whole = Path(location).parts
        for tail in (whole, whole[1:]):
            fits = []
            for path in self.listed:
                if not tail or path[-len(tail) :] != tail:
                    continue
                # A link may lead out of the folder.
                if self.inputs.joinpath(*path).resolve().is_relative_to(self.inputs):
                    fits.append(path)
            if len(fits) > 1:
                shown = ", ".join(str(Path(*path)) for path in fits[:3])
                raise InputError(
                    f"{name!r}: {len(fits)} files below the folder of inputs fit ({shown}), "
                    "expected one"
                )
            if fits:
                warn(f"{name!r} is taken from {Path(*fits[0])}, the only file that fits")
                return self.inputs.joinpath(*fits[0]).resolve()
        return None

    def walked(self) -> Iterator[Path]:
        """Yield all folders and files below the folder of inputs."""
        for folder, folders, files in os.walk(self.inputs):
            for name in (*folders, *files):
                yield Path(folder, name)

    def parsed(self, path: Path) -> Element:
        """Return the root of an XML file, bounded in size and count.

        Namespaces are dropped, except that of xacro, and `$(optenv NAME DEFAULT)` becomes its
        default.
        """
        self.opened += 1
        root = parsed(path, self.bytes_left)
        self.bytes_left -= path.stat().st_size
        if self.opened > MOST_FILES:
            raise InputError(f"{path}: one file too many, expected at most {MOST_FILES}")
        for element in root.iter():
            if "xacro" not in element.tag:
                element.tag = element.tag.rsplit("}", 1)[-1]
            element.text = OPTIONAL.sub(r"\1", element.text or "")
            for key, value in element.attrib.items():
                element.attrib[key] = OPTIONAL.sub(r"\1", value)
        return root

    def mesh(self, name: str, base: Path, scale: np.ndarray, part: str | None = None) -> np.ndarray:
        """Return the triangles (K, 3, 3) m of a mesh file, scaled.

        A COLLADA file's own unit counts.
        """
        path = self.find(name, base)
        if path.suffix.lower() not in suffixes():
            raise InputError(f"{name!r} is no mesh of a known format, expected one of {suffixes()}")
        unit = 1.0
        if path.suffix.lower() == ".dae":
            unit = stated_metres(path) or 1.0
        if (path, part) not in self.read:
            self.read[path, part] = selected(path, [part] if part else None)
        found = self.read[path, part]
        refuse_many(self.triangles + sum(len(piece.faces) for piece in found), self._own())
        pieces = [piece.vertices[piece.faces] for piece in found]
        if not pieces:
            raise InputError(f"{name!r} has no triangle, expected a surface")
        triangles = np.concatenate(pieces) * unit * scale
        if np.prod(scale) < 0:
            # A mirror image turns the surface inside out.
            return triangles[:, ::-1]
        return triangles

    def _own(self) -> int:
        """The triangles of the meshes read so far, each once."""
        return sum(len(piece.faces) for pieces in self.read.values() for piece in pieces)

    def shown(self, triangles: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Return triangles (K, 3, 3) at a place; those of the whole description are counted.

        Raises: InputError where they are too many.
        """
        self.triangles += len(triangles)
        refuse_many(self.triangles, self._own())
        return shown(triangles, place)


def primitive(kind: str, size: np.ndarray) -> np.ndarray:
    """Triangles (K, 3, 3) of a box, cylinder, capsule, sphere or ellipsoid.

    size: the edges of a box, the radius and length along z of a cylinder or capsule, the radii of a
    sphere or ellipsoid.
    """
    from trimesh import creation

    if kind == "box":
        shape = creation.box(size)
    elif kind in ("sphere", "ellipsoid"):
        shape = creation.icosphere(2)
        shape.vertices = shape.vertices * size
    else:
        make = creation.capsule if kind == "capsule" else creation.cylinder
        shape = make(radius=size[0], height=size[1])
        shape.apply_translation([0, 0, -float(shape.bounds.mean(axis=0)[2])])
    return np.asarray(shape.triangles)


def shown(triangles: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Triangles (K, 3, 3) at a pose (4, 4)."""
    return portable.applied(pose[:3, :3], triangles) + pose[:3, 3]


def direction(axis: np.ndarray) -> np.ndarray:
    """A direction (3,) of length one. Raises: ValueError for none."""
    if not axis.any():
        raise ValueError("an axis of zeros, expected a direction")
    return axis / portable.norm(axis)
