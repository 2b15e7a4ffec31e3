"""Files that are small on disk and ask for far more memory or time, and what becomes of a reader
that is given one.
"""

import contextlib
import json
import os
import resource
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from lowalt.files.errors import InputError

MEGABYTES = 500
SECONDS = 8
"""Address space and processor time that a reader may take before it refuses a file."""


class Bomb(NamedTuple):
    """A file, its reader and the sentence that refuses it.

    content: the bytes or text of the file, or a function that returns them; if `writes`, a function
    that writes the file to a path.
    """

    name: str
    content: bytes | str | Callable[[], bytes | str] | Callable[[Path], None]
    read: Callable[[Path], object]
    expected: str
    writes: bool = False


def refusal_of(read: Callable[[], object]) -> str:
    """Return the sentence with which a reader refuses a file, in a process of its own with limited
    memory and time; another end in words.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        with contextlib.suppress(BaseException):
            os.write(writing, json.dumps(_outcome(read)).encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as answer:
        said = answer.read()
    status = os.waitpid(child, 0)[1]
    return json.loads(said) if said else f"the process ended with {status}"


def _outcome(read: Callable[[], object]) -> str:
    """What becomes of the reader in this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + (MEGABYTES << 20)
    spent = resource.getrusage(resource.RUSAGE_SELF)
    seconds = int(spent.ru_utime + spent.ru_stime) + SECONDS
    resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.RLIM_INFINITY))
    try:
        read()
    except InputError as error:
        return str(error)
    except BaseException as error:
        return f"no refusal but {type(error).__name__}: {error}"
    return "accepted"


def pipe(path: Path) -> None:
    """Make a pipe that nobody writes into."""
    os.mkfifo(path)


def obj_star(corners: int, faces: int = 1) -> str:
    """An OBJ file of faces with this many corners, every second one turned inward."""
    angle = 2 * np.pi * np.arange(corners) / corners
    radius = np.where(np.arange(corners) % 2, 0.5, 1.0)
    places = zip(radius * np.cos(angle), radius * np.sin(angle), strict=True)
    face = "f " + " ".join(map(str, range(1, corners + 1))) + "\n"
    return "".join(f"v {x:.7f} {y:.7f} 0\n" for x, y in places) + faces * face


def collada_of_nodes(levels: int) -> str:
    """A COLLADA file of one triangle, whose nodes each show the one before them twice."""
    nodes = "".join(
        f'<node id="n{k}"><instance_node url="#n{k - 1}"/><instance_node url="#n{k - 1}"/></node>'
        for k in range(1, levels)
    )
    return (
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>'
        '<library_geometries><geometry id="g"><mesh><source id="s"><float_array id="f" count="9">'
        '0 0 0 1 0 0 0 1 0</float_array><technique_common><accessor source="#f" count="3" '
        'stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" '
        'type="float"/></accessor></technique_common></source><vertices id="v"><input '
        'semantic="POSITION" source="#s"/></vertices><triangles count="1"><input offset="0" '
        'semantic="VERTEX" source="#v"/><p>0 1 2</p></triangles></mesh></geometry>'
        '</library_geometries><library_nodes><node id="n0"><instance_geometry url="#g"/></node>'
        f'{nodes}</library_nodes><library_visual_scenes><visual_scene id="z"><node><instance_node '
        f'url="#n{levels - 1}"/></node></visual_scene></library_visual_scenes><scene>'
        '<instance_visual_scene url="#z"/></scene></COLLADA>'
    )


def matlab_zeros(megabytes: int, variables: int = 1) -> bytes:
    """A MATLAB 5 file of compressed variables of zeros, each this large once it is unpacked."""
    count = megabytes << 17
    flags = struct.pack("<IIII", 6, 8, 6, 0)
    shape = struct.pack("<IIii", 5, 8, 1, count)
    name = struct.pack("<HHI", 1, 1, ord("x"))
    body = flags + shape + name + struct.pack("<II", 9, 8 * count)
    packer = zlib.compressobj(1)
    parts = [packer.compress(struct.pack("<II", 14, len(body) + 8 * count) + body)]
    parts += [packer.compress(bytes(1 << 20)) for _ in range(megabytes)]
    data = b"".join([*parts, packer.flush()])
    head = b"MATLAB 5.0".ljust(124) + struct.pack("<H", 0x100) + b"IM"
    return head + variables * (struct.pack("<II", 15, len(data)) + data)


def glb(content: dict) -> bytes:
    """A GLB file of this JSON, without binary data."""
    text = json.dumps({"asset": {"version": "2.0"}, **content}).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text))
    return head + struct.pack("<I4s", len(text), b"JSON") + text


def wav(channels: int, data: bytes, block: int = 2) -> bytes:
    """A WAV file of 16-bit samples that states this number of channels."""
    about = struct.pack("<IHHIIHH", 16, 1, channels, 8000, 8000 * block, block, 16)
    body = b"WAVEfmt " + about + b"data" + struct.pack("<I", len(data)) + data
    return b"RIFF" + struct.pack("<I", len(body)) + body


def outline(corners: int, inner: float) -> list[list[float]]:
    """A closed ring of longitudes and latitudes about 200 m wide; every second corner is `inner`
    times as far from its middle.
    """
    angle = 2 * np.pi * np.arange(corners) / corners
    radius = np.where(np.arange(corners) % 2, inner, 1.0) * 1e-3
    ring = np.stack([11.5 + radius * np.cos(angle), 48.1 + radius * np.sin(angle)], axis=1).tolist()
    return [*ring, ring[0]]


def town(*rings: list) -> str:
    """A GeoJSON file of a building of each ring."""
    features = [
        {
            "type": "Feature",
            "properties": {"building": "yes", "height": 10},
            "geometry": {"type": "Polygon", "coordinates": [ring]},
        }
        for ring in rings
    ]
    return json.dumps({"type": "FeatureCollection", "features": features})


def check_refused(bomb: Bomb, folder: Path) -> None:
    """Assert that a bomb is refused in the expected sentence, which begins with its path."""
    path = folder / bomb.name
    if bomb.writes:
        bomb.content(path)
    else:
        content = bomb.content() if callable(bomb.content) else bomb.content
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    said = refusal_of(lambda: bomb.read(path))
    assert said.startswith(f"{path}: ")
    with pytest.raises(InputError, match=bomb.expected):
        raise InputError(said)
