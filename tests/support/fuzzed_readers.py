"""Every reader of files of the core with a good file of its kind, for `fuzzing` to damage."""

import hashlib
import json
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from craft import craft, row
from fuzzed_folders import folders
from fuzzed_seals import ARCHIVE, INDEX, JSON, MODEL, PNG, YAML
from fuzzing import Reader
from shown_meshes import dae, prism


def bytes_of(write: Callable[[Path], object], name: str) -> bytes:
    """The bytes of a file that `write` makes."""
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / name)
        return (Path(folder) / name).read_bytes()


def _meshes() -> list[Reader]:
    """Readers of meshes, each with a good file."""
    import trimesh

    from lowalt.targets.mesh_files import read_mesh

    box = trimesh.creation.box((0.3, 0.4, 0.1)).subdivide()
    kinds = ("stl", "obj", "dae")
    readers = []
    for kind in kinds:
        data = box.export(file_type=kind)
        data = data.encode() if isinstance(data, str) else bytes(data)
        readers.append(
            Reader(f"mesh .{kind}", f"a.{kind}", data, lambda path: read_mesh(path, "m"))
        )
    more = {
        "polygons .dae": dae(*prism()).encode(),
    }
    readers += [
        Reader(f"mesh {kind}", f"a{kind[-4:]}", data, lambda path: read_mesh(path, "m"))
        for kind, data in more.items()
    ]
    return readers


def _texts() -> list[Reader]:
    """Readers of configurations, tables and other texts, each with a good file."""
    from lowalt.config.command import settings
    from lowalt.config.layers import check, merge
    from lowalt.files.csv_tables import read_csv
    from lowalt.files.yaml_files import load_yaml
    from lowalt.motion import read_table, write_table
    from lowalt.recognition import freeze, paper_claims, schemes
    from lowalt.shards import manifest
    from lowalt.targets.records import load_records, load_table
    from lowalt.workflow.run import Run

    config = load_yaml("config/default.yaml")
    schema = "workflow/schemas/config.schema.yaml"
    table = Path("config/targets.csv").read_bytes()

    def run(path: Path) -> object:
        """The run of a configuration file."""
        return Run.of(merge(config, load_yaml(path)), schema, None)

    def sums(path: Path) -> object:
        """Verify a file of checksums of one empty file."""
        (path.parent / "a").touch()
        return freeze.verify(path)

    return [
        Reader(
            "configuration",
            "a.yaml",
            Path("config/default.yaml").read_bytes(),
            lambda p: check(load_yaml(p), schema),
            seal=YAML,
        ),
        Reader("overlay", "a.yaml", Path("config/workstation.yaml").read_bytes(), run, seal=YAML),
        Reader("scene", "a.yaml", Path("config/scenes/worst.yaml").read_bytes(), run, seal=YAML),
        Reader(
            "whole configuration",
            "a.yaml",
            Path("config/default.yaml").read_bytes(),
            run,
            seal=YAML,
        ),
        Reader(
            "record of a target",
            "a.yaml",
            Path("config/targets/pedestrian.yaml").read_bytes(),
            lambda p: load_records("config/targets.csv", [*config["targets"]["records"][:3], p]),
            seal=YAML,
        ),
        Reader("table of targets", "a.csv", table, load_table),
        Reader(
            "schemes",
            "a.csv",
            Path("config/schemes.csv").read_bytes(),
            lambda p: schemes.read(p, "ABC"),
        ),
        Reader(
            "published accuracies",
            "a.csv",
            Path("config/published_accuracy.csv").read_bytes(),
            paper_claims.read_published,
        ),
        Reader("table", "a.csv", Path("config/cost/accuracy.csv").read_bytes(), read_csv),
        Reader(
            "motion table",
            "a.csv",
            bytes_of(lambda p: write_table(p, [row(n) for n in range(5)]), "a.csv"),
            read_table,
        ),
        Reader(
            "manifest",
            "a.sha256",
            Path("results/reference/tiny.sha256").read_bytes(),
            manifest.read,
        ),
        Reader(
            "checksums", "SHA256SUMS", (hashlib.sha256(b"").hexdigest() + "  a\n").encode(), sums
        ),
        Reader(
            "settings",
            "a.json",
            json.dumps({"seed": 1, "network": config["network"]}).encode(),
            lambda p: settings(f"@{p}"),
            seal=JSON,
        ),
    ]


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
    joints = bytes_of(lambda path: np.savez(path, joints=np.ones((4, 22, 3)), fps=30.0), "a.npz")
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
    tile = encode(
        np.add.outer(np.arange(48), np.arange(48)).astype(np.uint8), np.zeros((256, 3), np.uint8)
    )
    wave = np.exp(0.3j * np.arange(1200)).reshape(3, 400).astype(np.complex64)
    signals = bytes_of(lambda p: np.save(p, wave), "a.npy")
    count = 6
    facts = samples.Facts(
        *(np.array([f"{name}{n}" for n in range(count)]) for name in ("k", "s")),
        np.arange(count),
        np.full(count, 3.0),
        np.full(count, "seen"),
        np.full(count, "train"),
        np.arange(count) % 4,
        np.ones((count, 3)),
        np.ones((count, 3)),
    )
    cache = bytes_of(
        lambda p: samples.write(p, np.zeros((count, 9, 16, 16), np.uint8), facts), "a.npz"
    )
    rows = np.zeros(count, sample_table.SAMPLE)
    header = bytes_of(
        lambda p: sample_table.write(p, {"name": "a", "samples": count}, rows), "a.npz"
    )
    surfaces = bytes_of(
        lambda p: occluders.write(p, dict.fromkeys(occluders.ARRAYS, np.zeros(3)), "a"), "a.npz"
    )
    tiles = bytes_of(lambda p: write_tiles(p, [png, png]), "a.npz")
    model = bytes_of(lambda p: checkpoint.save(p, "{}", {"weights": {"a": torch.ones(5)}}), "a.pt")
    said = predictions.from_facts(facts, (0,), np.eye(4)[np.arange(count) % 4])
    return [
        Reader(
            "cloud",
            "a.npz",
            bytes_of(lambda p: write_cloud(p, craft()), "a.npz"),
            read_cloud,
            seal=ARCHIVE,
        ),
        Reader("occluders", "a.npz", surfaces, occluders.read, seal=ARCHIVE),
        Reader(
            "views",
            "a.npz",
            cache,
            lambda p: samples.ViewSamples([p], [0, 1], {("seen", "train")}),
            seal=ARCHIVE,
        ),
        Reader(
            "shard table", "a.npz", header, lambda p: (read_header(p), map_samples(p)), seal=ARCHIVE
        ),
        Reader("index", "index.json", _index(render), load_index, seal=INDEX),
        Reader("tiles", "a.npz", tiles, lambda p: _all(Tiles(p)), seal=ARCHIVE),
        Reader("image", "a.png", png, lambda p: decode(p.read_bytes()), seal=PNG),
        Reader("tile to predict", "a.png", tile, lambda p: images_of(p, render), seal=PNG),
        Reader("signals to predict", "a.npy", signals, lambda p: images_of(p, render)),
        Reader("checkpoint", "a.pt", model, checkpoint.load),
        Reader(
            "predictions",
            "a.csv",
            bytes_of(lambda p: predictions.write(p, said), "a.csv"),
            predictions.read,
        ),
    ]


def _index(render: dict) -> bytes:
    """The bytes of an index of one shard."""
    entry = {
        "name": "a",
        "path": "a.tar",
        "group": "seen",
        "fold": "train",
        "samples": 6,
        "bytes": 1,
        "kind": "image",
        "table_sha256": "0" * 64,
        "sha256": "0" * 64,
    }
    index = {
        "format": "lowalt-shards-2",
        "shards": [entry],
        "kind": "image",
        "samples": 6,
        "render": render,
    }
    return INDEX.closed({"index": json.dumps(index).encode()})


def _models() -> list[Reader]:
    """Readers of trained models."""
    from lowalt.recognition import model_file

    path = Path("results/zoo/default-seen.safetensors")
    return [
        Reader(
            "model file", "a.safetensors", path.read_bytes(), model_file.read, share=0.2, seal=MODEL
        ),
    ]


def _all(tiles) -> list[bytes]:
    """All images of a tiles file."""
    return [tiles[number] for number in range(len(tiles))]


def readers() -> list[Reader]:
    """Return every reader of the core with a good file of its kind."""
    return [*_texts(), *_arrays(), *_models(), *_captures(), *_meshes(), *folders()]
