"""Seals of files: how a file is taken apart and put together again with right checksums, so that damage reaches the
reader behind them."""

import contextlib
import hashlib
import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable
from typing import NamedTuple

import yaml
from safetensors.torch import load as load_tensors
from safetensors.torch import save as save_tensors
from scipy.io import loadmat, savemat

from lowalt.recognition import model_file
from lowalt.tiles.png import SIGNATURE

Parts = dict[str, bytes]


class Seal(NamedTuple):
    """The parts of a file's bytes by name, and the bytes of such parts with lengths and checksums that fit them."""

    opened: Callable[[bytes], Parts]
    closed: Callable[[Parts], bytes]


def _members(data: bytes) -> Parts:
    """The members of an archive of arrays."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _archive(parts: Parts) -> bytes:
    """An archive of arrays with these members."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, data in parts.items():
            archive.writestr(name, data)
    return out.getvalue()


def _chunks(data: bytes) -> Parts:
    """The chunks of a PNG by place and name, the image data expanded."""
    parts, place = {}, len(SIGNATURE)
    while place < len(data):
        length, name = struct.unpack_from(">I4s", data, place)
        body = data[place + 8 : place + 8 + length]
        parts[f"{len(parts)} {name.decode()}"] = zlib.decompress(body) if name == b"IDAT" else body
        place += 12 + length
    return parts


def _png(parts: Parts) -> bytes:
    """A PNG of these chunks."""
    data = SIGNATURE
    for key, body in parts.items():
        name = key[-4:].encode()
        body = zlib.compress(body) if name == b"IDAT" else body
        data += struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
    return data


def _index(parts: Parts) -> bytes:
    """An index with the SHA-256 of its content; what is no JSON object stays as it is."""
    try:
        content = json.loads(parts["index"])
        signed = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
        return json.dumps(content | {"sha256": signed}).encode()
    except (ValueError, TypeError, RecursionError):
        return parts["index"]


def _json_of_yaml(data: bytes) -> Parts:
    """A YAML file as JSON, which is YAML too."""
    return {"json": json.dumps(yaml.safe_load(data), default=str).encode()}


def _model(data: bytes) -> Parts:
    """What a model file says of itself, and the file."""
    size = int.from_bytes(data[:8], "little")
    about = json.loads(json.loads(data[8 : 8 + size])["__metadata__"]["lowalt"])
    return {"about": json.dumps(about | {"digest": None}).encode(), "file": data}


def _signed_model(parts: Parts) -> bytes:
    """A model file that says this of itself, with the SHA-256 of its content; a damaged file stays as it is."""
    try:
        tensors = load_tensors(parts["file"])
    except Exception:
        return parts["file"]
    text = parts["about"].decode(errors="replace")
    with contextlib.suppress(ValueError, RecursionError, AttributeError):
        about = json.loads(text)
        del about["digest"]
        text = json.dumps(about | {"digest": model_file._digest(tensors, about)})
    return save_tensors(tensors, {"lowalt": text})


def _unsigned(data: bytes) -> Parts:
    """The content of an index without its checksum."""
    content = json.loads(data)
    del content["sha256"]
    return {"index": json.dumps(content).encode()}


def _plain_matlab(data: bytes) -> Parts:
    """A MATLAB file without compression."""
    out = io.BytesIO()
    savemat(out, {name: array for name, array in loadmat(io.BytesIO(data)).items() if not name.startswith("__")})
    return {"file": out.getvalue()}


YAML = Seal(_json_of_yaml, lambda parts: parts["json"].replace(b"Infinity", b".inf").replace(b"NaN", b".nan"))
JSON = Seal(lambda data: {"json": data}, lambda parts: parts["json"])
MODEL = Seal(_model, _signed_model)
ARCHIVE = Seal(_members, _archive)
PNG = Seal(_chunks, _png)
INDEX = Seal(_unsigned, _index)
MATLAB = Seal(_plain_matlab, lambda parts: parts["file"])
