"""Prepare COLLADA files for trimesh's reader.

The reader leaves out the stated unit, dented polygons, skins and whatever has a missing texture.
Skins are refused.

Source: Khronos, COLLADA 1.4.1, elements unit, polylist, polygons and instance_controller.
"""

import math
import re
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from lowalt.files.atomic import bytes_of
from lowalt.files.errors import InputError
from lowalt.targets.mesh_polygons import LARGEST_TRIANGLES, refuse_many, triangulated

UNUSED = ("library_images", "library_effects", "library_materials", "bind_material")


MOST_XML_BYTES = 256 << 20
MOST_ELEMENTS = 2_000_000
"""Largest number of elements and attributes of an XML file; each takes some hundred bytes."""
INSTANCE_COST = 100
"""An instance of a geometry counts as at least this many triangles."""


class _Plain(ElementTree.TreeBuilder):
    """A tree of XML without a document type, which could name entities, and of bounded size."""

    def __init__(self) -> None:
        super().__init__()
        self.count = 0

    def start(self, tag: str, attributes: dict[str, str]) -> ElementTree.Element:
        """Begin an element. Raises: ValueError for more than MOST_ELEMENTS."""
        self.count += 1 + len(attributes)
        if self.count > MOST_ELEMENTS:
            raise ValueError(f"more than {MOST_ELEMENTS} elements and attributes")
        return super().start(tag, attributes)

    def doctype(self, *_: object) -> None:
        """Refuse a document type."""
        raise ValueError("it declares a document type, expected none")


def parsed(path: Path, most_bytes: int = MOST_XML_BYTES) -> ElementTree.Element:
    """Return the root of an XML file; nothing that it names is opened.

    Entities of its own are refused. A prefix that it does not declare, such as `gz:`, is part of
    the name, as Gazebo's own parser has it.

    Raises: InputError naming the file where it is no XML, declares a document type, or has more
    than `most_bytes` bytes or MOST_ELEMENTS elements.
    """
    data = bytes_of(path, "XML file", most_bytes)
    try:
        try:
            return ElementTree.fromstring(data, ElementTree.XMLParser(target=_Plain()))
        except ElementTree.ParseError as error:
            if error.code != expat.errors.codes[expat.errors.XML_ERROR_UNBOUND_PREFIX]:
                raise
            joined = re.sub(rb"(</?|\s)(\w+):(?=\w+[\s=/>])", rb"\1\2_", data)
            return ElementTree.fromstring(joined, ElementTree.XMLParser(target=_Plain()))
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{path}: not a readable XML file ({error})") from None


def _name(element: ElementTree.Element) -> str:
    """An element's tag without its namespace."""
    return element.tag.rsplit("}", 1)[-1]


def _first(elements: Iterable[ElementTree.Element], name: str) -> ElementTree.Element | None:
    """The first of the elements that has this tag, None where none has it."""
    return next((element for element in elements if _name(element) == name), None)


def stated_metres(path: Path) -> float | None:
    """Return the metres of the unit that a COLLADA file states, None where it states none.

    A unit that is no positive number counts as none.

    Raises: InputError where the file is no XML.
    """
    unit = _first(parsed(path).iter(), "unit")
    if unit is None:
        return None
    try:
        value = float(unit.get("meter", "nan"))
    except ValueError:
        return None
    if not 0 < value < math.inf:
        return None
    return value


def stated_up(path: Path) -> str | None:
    """Return the axis up, y or z, that a COLLADA file states, None where it says nothing or x.

    Raises: InputError where the file is no XML.
    """
    said = {
        (element.text or "").strip()
        for element in parsed(path).iter()
        if _name(element) == "up_axis"
    }
    if len(said) != 1:
        return None
    return {"Y_UP": "y", "Z_UP": "z"}.get(said.pop())


def for_trimesh(path: Path) -> tuple[bytes, dict[str, list[str]]]:
    """Return a COLLADA file whose polygons are triangles, cut as viewers cut them, and names.

    The names are those of its geometries by their ids: those of the nodes that show them, and their
    own.

    Raises: InputError naming the file where it is no XML or has skins; other exceptions for a
    damaged file.
    """
    root = parsed(path)
    for parent in root.iter():
        # pycollada leaves a surface out whose material names an image that it does not find; no
        # material counts here.
        parent.attrib.pop("material", None)
        for child in [child for child in parent if _name(child) in UNUSED]:
            parent.remove(child)
    elements = {element.get("id"): element for element in root.iter() if element.get("id")}
    for parent in root.iter():
        if _name(parent) == "instance_controller":
            raise InputError(
                f"{path}: has a skin or morph (instance_controller), expected plain surfaces: "
                "apply it before exporting, or export GLB"
            )
        if _name(parent) == "mesh":
            for element in parent:
                if _name(element) in ("polylist", "polygons"):
                    _cut(element, elements)
    _refuse_many_instances(root, elements)
    return ElementTree.tostring(root), _geometry_names(root, elements)


def _geometry_names(root: ElementTree.Element, elements: dict) -> dict[str, list[str]]:
    """Return the names of geometries by their ids: those of their nodes, and their own.

    A node without a name has those of the nearest one above it that has.
    """
    names: dict[str, list[str]] = {}

    def add_below(element: ElementTree.Element, above: list[str]) -> None:
        """Add the names of the geometries below an element; above: names of the nearest node."""
        for child in element:
            of_node: list[str] = []
            if _name(child) == "node":
                of_node = [child.get(key, "") for key in ("name", "id") if child.get(key)]
            if _name(child) == "instance_geometry":
                key = child.get("url", "")[1:]
                names.setdefault(key, []).extend(above)
                if key in elements and elements[key].get("name"):
                    names[key].append(elements[key].get("name"))
            add_below(child, of_node or above)

    add_below(root, [])
    return names


def _refuse_many_instances(root: ElementTree.Element, elements: dict) -> None:
    """Refuse a file whose nodes show too many triangles; a node that shows others twice, level upon
    level, makes billions of a few lines.

    elements: by their ids. Raises: InputError.
    """
    shown: dict[int, int] = {}

    def triangles(element: ElementTree.Element) -> int:
        """About how many triangles an element shows, a lone geometry its own."""
        if id(element) not in shown:
            shown[id(element)] = LARGEST_TRIANGLES + 1  # until it is counted: it may show itself
            shown[id(element)] = counted(element)
        return shown[id(element)]

    def counted(element: ElementTree.Element) -> int:
        """The sum over what stands in an element, and over what it names."""
        kind = _name(element)
        if kind in ("instance_geometry", "instance_node"):
            named = elements.get(element.get("url", "")[1:])
            return INSTANCE_COST + (0 if named is None else triangles(named))
        if kind == "geometry":
            return sum(_numbers_of(each) // 3 for each in element.iter() if _name(each) == "p")
        inner = ("node", "visual_scene", "instance_geometry", "instance_node")
        return sum(triangles(child) for child in element if _name(child) in inner)

    own = sum(triangles(element) for element in root.iter() if _name(element) == "geometry")
    for scene in root.iter():
        if _name(scene) == "visual_scene":
            refuse_many(triangles(scene), own)


def _numbers_of(element: ElementTree.Element) -> int:
    """About how many numbers the text of an element has."""
    text = element.text or ""
    return text.count(" ") + text.count("\n") + text.count("\t") + 1


def _cut(element: ElementTree.Element, elements: dict) -> None:
    """Turn an element of polygons into one of triangles."""
    inputs = [child for child in element if _name(child) == "input"]
    width = 1 + max(int(child.get("offset", 0)) for child in inputs)
    vertex = next(child for child in inputs if child.get("semantic") == "VERTEX")
    of_vertex = elements[vertex.get("source", "")[1:]]
    position = next(child for child in of_vertex if child.get("semantic") == "POSITION")
    source = elements[position.get("source")[1:]]
    numbers = next(child for child in source.iter() if _name(child) == "float_array")
    accessor = _first(source.iter(), "accessor")
    stride = 3
    if accessor is not None:
        stride = int(accessor.get("stride", 3))
    vertices = np.array((numbers.text or "").split(), float).reshape(-1, stride)[:, :3]
    lists = [
        np.array((child.text or "").split(), int).reshape(-1, width)
        for child in element
        if _name(child) == "p"
    ]
    rows = np.concatenate(lists)
    corner_counts = _first(element, "vcount")
    counts = np.array([len(polygon) for polygon in lists], int)
    if corner_counts is not None:
        counts = np.array((corner_counts.text or "").split(), int)
    # Corners, not vertices, so that their other numbers (normals, colours) go along.
    corners = vertices[rows[:, int(vertex.get("offset", 0))]]
    faces, _ = triangulated(corners, counts, np.arange(len(rows)))
    for child in [child for child in element if _name(child) in ("vcount", "p", "ph")]:
        element.remove(child)
    element.tag = element.tag.replace("polylist", "triangles").replace("polygons", "triangles")
    element.set("count", str(len(faces)))
    listed = ElementTree.SubElement(element, element.tag.replace("triangles", "p"))
    listed.text = " ".join(map(str, rows[faces.ravel()].ravel()))
