"""Every reader of files with a good file of its kind, for `fuzzing` to damage."""

import hashlib
import importlib.util
import json
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import yaml
from scipy.io import savemat, wavfile

import towns
from craft import craft, row
from fuzzed_folders import folders
from fuzzed_seals import ARCHIVE, INDEX, JSON, MATLAB, MODEL, PNG, YAML
from fuzzing import Reader
from shown_meshes import dae, ply, prism, skinned


def _bytes(write: Callable[[Path], object], name: str) -> bytes:
    """The bytes of a file that `write` makes."""
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / name)
        return (Path(folder) / name).read_bytes()


def _recording(kind: str) -> Callable[[Path], object]:
    """A reader of recordings of one kind."""
    from lowalt.extensions.recordings.files import read
    from lowalt.extensions.recordings.record import record

    more = {
        ".wav": {}, ".csv": {"columns": ["i", "q"], "rate_hz": 800.0}, ".sigmf-meta": {},
        ".txt": {"columns": ["i", "q"], "rate_hz": 800.0},
        ".iq": {"rate_hz": 800.0, "dtype": "float32", "layout": "iqiq"},
    }.get(kind, {"rate_hz": 800.0})  # fmt: skip
    base = {"carrier_hz": 24e9, "channel": "complex", "source": "test", "licence": "none", **more}
    return lambda path: read(record({**base, "file": path.name}, path.parent, "record"))


def _recordings() -> list[Reader]:
    """Readers of recordings, each with a good file."""
    times = np.arange(2000) / 800
    wave = np.exp(2j * np.pi * 97 * times) * (1 + 0.3 * np.cos(5 * times)) * 0.4
    pair = np.stack([wave.real, wave.imag], axis=1)
    text = "i,q\n" + "".join(f"{a:.6f},{b:.6f}\n" for a, b in pair)
    files = {
        ".wav": _bytes(lambda path: wavfile.write(path, 800, pair.astype(np.float32)), "a.wav"),
        ".mat": _bytes(lambda path: savemat(path, {"x": wave}, do_compression=True), "a.mat"),
        ".npy": _bytes(lambda path: np.save(path, wave), "a.npy"),
        ".csv": text.encode(),
        ".txt": text.replace(",", "\t").encode(),
        ".iq": pair.astype("<f4").tobytes(),
        ".cfile": wave.astype("<c8").tobytes(),
    }
    special = {".mat": {"share": 0.1, "seal": MATLAB}}
    cells = "iq;t\n" + "".join(f"{a:.6f}{b:+.6f}i;{t:.6f}\n" for (a, b), t in zip(pair, times, strict=True))
    about = {"core:datatype": "cf32_le", "core:sample_rate": 800, "core:version": "1.0.0"}
    captures = [{"core:sample_start": 0, "core:frequency": 24e9}]
    about = json.dumps({"global": about, "captures": captures, "annotations": []})
    more = [("recording .sigmf-meta", "a.sigmf-meta", about.encode(), _metadata),
            ("recording .csv, complex", "a.csv", cells.replace(".", ",").encode(), _semicolons)]  # fmt: skip
    if importlib.util.find_spec("h5py"):
        more.append(
            ("recording .mat 7.3", "a.mat", _bytes(lambda path: _hdf5(path, wave), "a.mat"), _recording(".mat"), 0.1)
        )
    return [
        Reader(f"recording {kind}", f"a{kind}", data, _recording(kind), **special.get(kind, {}))
        for kind, data in files.items()
    ] + [Reader(*each) for each in more]


def _semicolons(path: Path) -> object:
    """Read a table with semicolons, decimal commas and complex cells."""
    from lowalt.extensions.recordings.files import read
    from lowalt.extensions.recordings.record import record

    block = {"carrier_hz": 24e9, "channel": "complex", "source": "test", "licence": "none", "times": "t"}
    return read(record({**block, "file": path.name}, path.parent, "record"))


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


def _meshes() -> list[Reader]:
    """Readers of meshes, each with a good file."""
    import trimesh

    from lowalt.targets.mesh_files import read_mesh

    box = trimesh.creation.box((0.3, 0.4, 0.1)).subdivide()
    kinds = ("stl", "obj", "ply", "glb", "dae")
    readers = []
    for kind in kinds:
        data = box.export(file_type=kind)
        data = data.encode() if isinstance(data, str) else bytes(data)
        readers.append(Reader(f"mesh .{kind}", f"a.{kind}", data, lambda path: read_mesh(path, "m")))
    more = {"skinned .glb": _bytes(skinned, "a.glb"), "mixed .ply": ply(*prism(), "little", [[0, 1, 2, 3]]),
            "polygons .dae": dae(*prism()).encode()}  # fmt: skip
    readers += [Reader(f"mesh {kind}", f"a{kind[-4:]}", data, lambda path: read_mesh(path, "m"))
                for kind, data in more.items()]  # fmt: skip
    return readers


def _towns() -> list[Reader]:
    """Readers of buildings, each with a good file."""
    from lowalt.extensions.town.buildings import read
    from lowalt.extensions.town.town import DEFAULTS

    def buildings(path: Path) -> object:
        """Read a town; a Mitsuba scene has its mesh next to it."""
        towns.ply(path.with_name("cube.ply"), [(0.0, 0.0, 1.0, 1.0, 1.0)])
        origin = towns.ORIGIN if path.suffix == ".geojson" else None
        return read(DEFAULTS | {"buildings": str(path), "origin": origin})

    kinds = {".geojson": towns.geojson, ".xml": towns.mitsuba}
    good = {kind: _bytes(partial(write, boxes=towns.BOXES), f"a{kind}") for kind, write in kinds.items()}
    return [Reader(f"town {kind}", f"a{kind}", data, buildings) for kind, data in good.items()]


def _robots() -> list[Reader]:
    """Readers of robots' descriptions, each with a good file."""
    from lowalt.extensions.drafting.robot_files import read_robot
    from made_robots import MJCF, SDF, urdf

    files = {".urdf": urdf(blade="").replace('<mesh filename="" scale="0.001 0.001 0.001"/>', '<sphere radius="1"/>'),
             ".sdf": SDF, ".xml": MJCF.replace('type="mesh"', 'type="sphere" size="1"')}  # fmt: skip
    return [Reader(f"robot {kind}", f"a{kind}", text.encode(), lambda path: read_robot(path, path.parent))
            for kind, text in files.items()]  # fmt: skip


def _texts() -> list[Reader]:
    """Readers of configurations, tables and other texts, each with a good file."""
    from lowalt.config.command import settings
    from lowalt.config.layers import check, merge
    from lowalt.extensions.recordings.record import read_record
    from lowalt.extensions.recordings.twin_scenes import Library
    from lowalt.files.csv_tables import read_csv
    from lowalt.files.yaml_files import load_yaml
    from lowalt.motion import read_table, write_table
    from lowalt.recognition import freeze, paper_claims, schemes
    from lowalt.shards import manifest
    from lowalt.targets.records import load_records, load_table
    from lowalt.workflow.run import Run

    config, schema = load_yaml("config/default.yaml"), "workflow/schemas/config.schema.yaml"
    table = Path("config/targets.csv").read_bytes()

    def run(path: Path) -> object:
        """The run of a configuration file."""
        return Run.of(merge(config, load_yaml(path)), schema, None)

    def sums(path: Path) -> object:
        """Verify a file of checksums of one empty file."""
        (path.parent / "a").touch()
        return freeze.verify(path)

    def scenes(path: Path) -> object:
        """The twin and the scenes of the record of a radar."""
        return Library.read(path.parent)

    record = yaml.safe_dump({"file": "a.wav", "carrier_hz": 24e9, "channel": "complex", "source": "x", "licence": "y"})
    return [
        Reader("configuration", "a.yaml", Path("config/default.yaml").read_bytes(),
               lambda p: check(load_yaml(p), schema), seal=YAML),
        Reader("overlay", "a.yaml", Path("config/workstation.yaml").read_bytes(), run, seal=YAML),
        Reader("scene", "a.yaml", Path("config/scenes/worst.yaml").read_bytes(), run, seal=YAML),
        Reader("whole configuration", "a.yaml", Path("config/default.yaml").read_bytes(), run, seal=YAML),
        Reader("record of a target", "a.yaml", Path("config/targets/pedestrian.yaml").read_bytes(),
               lambda p: load_records("config/targets.csv", [*config["targets"]["records"][:3], p]), seal=YAML),
        Reader("record of a radar", "a.yaml", Path("config/measured/radars/cw_24ghz.yaml").read_bytes(), scenes,
               seal=YAML),
        Reader("table of targets", "a.csv", table, load_table),
        Reader("schemes", "a.csv", Path("config/schemes.csv").read_bytes(), lambda p: schemes.read(p, "ABC")),
        Reader("published accuracies", "a.csv", Path("config/published_accuracy.csv").read_bytes(),
               paper_claims.read_published),
        Reader("table", "a.csv", Path("config/cost/accuracy.csv").read_bytes(), read_csv),
        Reader("motion table", "a.csv", _bytes(lambda p: write_table(p, [row(n) for n in range(5)]), "a.csv"),
               read_table),
        Reader("manifest", "a.sha256", Path("results/reference/tiny.sha256").read_bytes(), manifest.read),
        Reader("checksums", "SHA256SUMS", (hashlib.sha256(b"").hexdigest() + "  a\n").encode(), sums),
        Reader("record of a recording", "a.yaml", record.encode(), read_record, seal=YAML),
        Reader("settings", "a.json", json.dumps({"seed": 1, "network": config["network"]}).encode(),
               lambda p: settings(f"@{p}"), seal=JSON),
    ]  # fmt: skip


def _captures() -> list[Reader]:
    """Readers of motion capture, each with a good file."""
    from lowalt.targets.mocap_files import read_motion, read_skeleton
    from lowalt.targets.mocap_joints import read_bvh, read_joints
    from lowalt.targets.skeleton import NODES
    from walkers import BVH, asf, walk

    text = asf({name: np.array([0.3, 1.0, 0.1]) for name in NODES})
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.asf"
        path.write_text(text)
        skeleton = read_skeleton(path)
    joints = _bytes(lambda path: np.savez(path, joints=np.ones((4, 22, 3)), fps=30.0), "a.npz")
    return [
        Reader("skeleton .asf", "a.asf", text.encode(), read_skeleton),
        Reader("motion .amc", "a.amc", walk(40).encode(), lambda path: read_motion(path, skeleton)),
        Reader("motion .bvh", "a.bvh", BVH.encode(), read_bvh),
        Reader("motion .npz", "a.npz", joints, read_joints, seal=ARCHIVE),
    ]


def _arrays() -> list[Reader]:
    """Readers of arrays, shards and models, each with a good file."""
    import torch

    from lowalt.files.yaml_files import load_yaml
    from lowalt.recognition import checkpoint, predictions, samples
    from lowalt.recognition.predict_sample import images_of
    from lowalt.shards import sample_table
    from lowalt.shards.index import load as load_index
    from lowalt.shards.sample_table import map_samples, read_header
    from lowalt.targets import occluders
    from lowalt.targets.cloud import read as read_cloud
    from lowalt.targets.cloud import write as write_cloud
    from lowalt.tiles.png import decode, encode
    from lowalt.tiles.tile_files import Tiles
    from lowalt.tiles.tile_files import write as write_tiles

    image = np.add.outer(np.arange(24), np.arange(24)).astype(np.uint8)
    png = encode(image, np.stack([np.arange(256)] * 3, 1).astype(np.uint8))
    config = load_yaml("config/default.yaml")
    render = {key: config[key] for key in ("network", "spectra", "images")}
    tile = encode(np.add.outer(np.arange(48), np.arange(48)).astype(np.uint8), np.zeros((256, 3), np.uint8))
    wave = np.exp(0.3j * np.arange(1200)).reshape(3, 400).astype(np.complex64)
    signals = _bytes(lambda p: np.save(p, wave), "a.npy")
    count = 6
    facts = samples.Facts(
        *(np.array([f"{name}{n}" for n in range(count)]) for name in ("k", "s")), np.arange(count), np.full(count, 3.0),
        np.full(count, "seen"), np.full(count, "train"), np.arange(count) % 4, np.ones((count, 3)), np.ones((count, 3)),
    )  # fmt: skip
    cache = _bytes(lambda p: samples.write(p, np.zeros((count, 9, 16, 16), np.uint8), facts), "a.npz")
    rows = np.zeros(count, sample_table.SAMPLE)
    header = _bytes(lambda p: sample_table.write(p, {"name": "a", "samples": count}, rows), "a.npz")
    surfaces = _bytes(lambda p: occluders.write(p, dict.fromkeys(occluders.ARRAYS, np.zeros(3)), "a"), "a.npz")
    tiles = _bytes(lambda p: write_tiles(p, [png, png]), "a.npz")
    model = _bytes(lambda p: checkpoint.save(p, "{}", {"weights": {"a": torch.ones(5)}}), "a.pt")
    said = predictions.from_facts(facts, (0,), np.eye(4)[np.arange(count) % 4])
    return [
        Reader("cloud", "a.npz", _bytes(lambda p: write_cloud(p, craft()), "a.npz"), read_cloud, seal=ARCHIVE),
        Reader("occluders", "a.npz", surfaces, occluders.read, seal=ARCHIVE),
        Reader("views", "a.npz", cache, lambda p: samples.ViewSamples([p], [0, 1], {("seen", "train")}), seal=ARCHIVE),
        Reader("shard table", "a.npz", header, lambda p: (read_header(p), map_samples(p)), seal=ARCHIVE),
        Reader("index", "index.json", _index(render), load_index, seal=INDEX),
        Reader("tiles", "a.npz", tiles, lambda p: _all(Tiles(p)), seal=ARCHIVE),
        Reader("image", "a.png", png, lambda p: decode(p.read_bytes()), seal=PNG),
        Reader("tile to predict", "a.png", tile, lambda p: images_of(p, render), seal=PNG),
        Reader("signals to predict", "a.npy", signals, lambda p: images_of(p, render)),
        Reader("checkpoint", "a.pt", model, checkpoint.load),
        Reader("predictions", "a.csv", _bytes(lambda p: predictions.write(p, said), "a.csv"), predictions.read),
    ]


def _index(render: dict) -> bytes:
    """The bytes of an index of one shard."""
    entry = {"name": "a", "path": "a.tar", "group": "seen", "fold": "train", "samples": 6, "bytes": 1,
             "kind": "image", "table_sha256": "0" * 64, "sha256": "0" * 64}  # fmt: skip
    index = {"format": "lowalt-shards-2", "shards": [entry], "kind": "image", "samples": 6, "render": render}
    return INDEX.closed({"index": json.dumps(index).encode()})


def _models() -> list[Reader]:
    """Readers of trained models."""
    from lowalt.recognition import model_file, zoo_files

    path = zoo_files.path_of("default-seen")
    return [
        Reader("model file", "a.safetensors", path.read_bytes(), model_file.read, share=0.2, seal=MODEL),
    ]


def _all(tiles) -> list[bytes]:
    """All images of a tiles file."""
    return [tiles[number] for number in range(len(tiles))]


def readers() -> list[Reader]:
    """Return every reader with a good file of its kind."""
    texts = [*_texts(), *_arrays(), *_models(), *_captures(), *_recordings()]
    return [*texts, *_meshes(), *_towns(), *_robots(), *folders()]
