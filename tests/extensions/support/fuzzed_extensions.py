"""Every reader of files of the extensions with a good file of its kind, for `fuzzing` to damage."""

import importlib.util
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import trimesh
import yaml
from scipy.io import savemat, wavfile

import towns
from fuzzed_readers import bytes_of
from fuzzed_seals import MATLAB, YAML
from fuzzing import Reader
from lowalt.extensions.drafting.robot_files import read_robot
from lowalt.extensions.recordings.files import read
from lowalt.extensions.recordings.record import read_record
from lowalt.extensions.recordings.record import record as recording
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.extensions.town.buildings import read as read_town
from lowalt.extensions.town.town import DEFAULTS
from lowalt.targets.mesh_files import read_mesh
from made_robots import MJCF, SDF, urdf
from shown_meshes import ply, prism, skinned


def _recording(kind: str) -> Callable[[Path], object]:
    """A reader of recordings of one kind."""
    more = {
        ".wav": {},
        ".csv": {"columns": ["i", "q"], "rate_hz": 800.0},
        ".sigmf-meta": {},
        ".txt": {"columns": ["i", "q"], "rate_hz": 800.0},
        ".iq": {"rate_hz": 800.0, "dtype": "float32", "layout": "iqiq"},
    }.get(kind, {"rate_hz": 800.0})
    base = {"carrier_hz": 24e9, "channel": "complex", "source": "test", "licence": "none", **more}
    return lambda path: read(recording({**base, "file": path.name}, path.parent, "record"))


def _recordings() -> list[Reader]:
    """Readers of recordings, each with a good file."""
    times = np.arange(2000) / 800
    wave = np.exp(2j * np.pi * 97 * times) * (1 + 0.3 * np.cos(5 * times)) * 0.4
    pair = np.stack([wave.real, wave.imag], axis=1)
    text = "i,q\n" + "".join(f"{a:.6f},{b:.6f}\n" for a, b in pair)
    files = {
        ".wav": bytes_of(lambda path: wavfile.write(path, 800, pair.astype(np.float32)), "a.wav"),
        ".mat": bytes_of(lambda path: savemat(path, {"x": wave}, do_compression=True), "a.mat"),
        ".npy": bytes_of(lambda path: np.save(path, wave), "a.npy"),
        ".csv": text.encode(),
        ".txt": text.replace(",", "\t").encode(),
        ".iq": pair.astype("<f4").tobytes(),
        ".cfile": wave.astype("<c8").tobytes(),
    }
    special = {".mat": {"share": 0.1, "seal": MATLAB}}
    cells = "iq;t\n" + "".join(
        f"{a:.6f}{b:+.6f}i;{t:.6f}\n" for (a, b), t in zip(pair, times, strict=True)
    )
    about = {"core:datatype": "cf32_le", "core:sample_rate": 800, "core:version": "1.0.0"}
    captures = [{"core:sample_start": 0, "core:frequency": 24e9}]
    about = json.dumps({"global": about, "captures": captures, "annotations": []})
    more = [
        ("recording .sigmf-meta", "a.sigmf-meta", about.encode(), _metadata),
        ("recording .csv, complex", "a.csv", cells.replace(".", ",").encode(), _semicolons),
    ]
    if importlib.util.find_spec("h5py"):
        more.append(
            (
                "recording .mat 7.3",
                "a.mat",
                bytes_of(lambda path: _hdf5(path, wave), "a.mat"),
                _recording(".mat"),
                0.1,
            )
        )
    return [
        Reader(f"recording {kind}", f"a{kind}", data, _recording(kind), **special.get(kind, {}))
        for kind, data in files.items()
    ] + [Reader(*each) for each in more]


def _semicolons(path: Path) -> object:
    """Read a table with semicolons, decimal commas and complex cells."""
    block = {
        "carrier_hz": 24e9,
        "channel": "complex",
        "source": "test",
        "licence": "none",
        "times": "t",
    }
    return read(recording({**block, "file": path.name}, path.parent, "record"))


def _hdf5(path: Path, wave: np.ndarray) -> None:
    """Write samples as MATLAB's version 7.3 does."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        pair = np.zeros(len(wave), [("real", "<f8"), ("imag", "<f8")])
        pair["real"], pair["imag"] = wave.real, wave.imag
        file["rec/iq"] = pair


def _metadata(path: Path) -> object:
    """Read a SigMF recording whose metadata are damaged, beside good samples."""
    values = np.exp(0.7j * np.arange(2000)) * (1 + 0.1 * np.cos(0.01 * np.arange(2000)))
    values.astype(np.complex64).tofile(path.with_suffix(".sigmf-data"))
    return _recording(".sigmf-meta")(path)


def _towns() -> list[Reader]:
    """Readers of buildings, each with a good file."""

    def buildings(path: Path) -> object:
        """Read a town; a Mitsuba scene has its mesh next to it."""
        towns.ply(path.with_name("cube.ply"), [(0.0, 0.0, 1.0, 1.0, 1.0)])
        origin = towns.ORIGIN if path.suffix == ".geojson" else None
        return read_town(DEFAULTS | {"buildings": str(path), "origin": origin})

    kinds = {".geojson": towns.geojson, ".xml": towns.mitsuba}
    good = {
        kind: bytes_of(partial(write, boxes=towns.BOXES), f"a{kind}")
        for kind, write in kinds.items()
    }
    return [Reader(f"town {kind}", f"a{kind}", data, buildings) for kind, data in good.items()]


def _robots() -> list[Reader]:
    """Readers of robots' descriptions, each with a good file."""
    files = {
        ".urdf": urdf(blade="").replace(
            '<mesh filename="" scale="0.001 0.001 0.001"/>', '<sphere radius="1"/>'
        ),
        ".sdf": SDF,
        ".xml": MJCF.replace('type="mesh"', 'type="sphere" size="1"'),
    }
    return [
        Reader(
            f"robot {kind}", f"a{kind}", text.encode(), lambda path: read_robot(path, path.parent)
        )
        for kind, text in files.items()
    ]


def _records() -> list[Reader]:
    """Readers of records of recordings and radars, each with a good file."""
    block = {
        "file": "a.wav",
        "carrier_hz": 24e9,
        "channel": "complex",
        "source": "x",
        "licence": "y",
    }
    radar = Path("config/measured/radars/cw_24ghz.yaml").read_bytes()
    return [
        Reader(
            "record of a radar",
            "a.yaml",
            radar,
            lambda path: Library.read(path.parent),
            seal=YAML,
        ),
        Reader(
            "record of a recording",
            "a.yaml",
            yaml.safe_dump(block).encode(),
            read_record,
            seal=YAML,
        ),
    ]


def _meshes() -> list[Reader]:
    """Readers of the formats of meshes that extensions add, each with a good file."""
    box = trimesh.creation.box((0.3, 0.4, 0.1)).subdivide()
    files = {
        ".ply": box.export(file_type="ply"),
        ".glb": box.export(file_type="glb"),
        "skinned .glb": bytes_of(skinned, "a.glb"),
        "mixed .ply": ply(*prism(), "little", [[0, 1, 2, 3]]),
    }
    return [
        Reader(f"mesh {kind}", f"a{kind[-4:]}", bytes(data), lambda path: read_mesh(path, "m"))
        for kind, data in files.items()
    ]


def readers() -> list[Reader]:
    """Return every reader of the extensions with a good file of its kind."""
    return [*_records(), *_recordings(), *_meshes(), *_towns(), *_robots()]
