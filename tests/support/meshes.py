"""Small meshes made for tests, with their records: a quadcopter, a bird, a car."""

from pathlib import Path

import numpy as np
import trimesh

from lowalt.targets import cloud as clouds
from lowalt.targets import mesh
from lowalt.targets.records import load_table, merge

ROOT = Path(__file__).parents[2]
TABLE = load_table(ROOT / "config/targets.csv")


def made(subtype: str, folder: Path, seed: int = 1, **record) -> clouds.Cloud:
    """Return the checked cloud of a subtype from the meshes of a folder."""
    merged = merge(TABLE[subtype], {"source": "mesh", **record}, subtype)
    return clouds.check(mesh.mesh_cloud(merged, folder, seed), subtype)


def plain(file: str, **changes) -> dict:
    """A record that takes a whole file as a UAV's body, any size."""
    record = {
        "unit": "m",
        "up": "z",
        "front": "y",
        "size_is": "largest extent",
        "scale": "none",
        "scale_limit": 1e6,
    }
    return record | {"parts": {"body": {"kind": "body", "meshes": [{"file": file}]}}} | changes


def box(size, at=(0, 0, 0)) -> trimesh.Trimesh:
    """Return a box of edges `size` around `at` (m)."""
    shape = trimesh.creation.box(size)
    shape.apply_translation(at)
    return shape


def saved(path: Path, shapes: dict[str, trimesh.Trimesh], keyword: str = "o") -> Path:
    """Write named shapes as objects (o) or groups (g) of an OBJ file, and return its path."""
    lines = []
    first = 1
    for name, shape in shapes.items():
        lines += [f"{keyword} {name}", *(f"v {x} {y} {z}" for x, y, z in shape.vertices)]
        lines += ["f " + " ".join(str(first + corner) for corner in face) for face in shape.faces]
        first += len(shape.vertices)
    path.write_text("\n".join(lines) + "\n")
    return path


def write_quad(folder: Path) -> Path:
    """Write a body with arms along its file's x (front), and a propeller with its hub at the
    origin.
    """
    box((0.2, 0.12, 0.06)).export(folder / "body.stl")
    box((0.2, 0.02, 0.004)).export(folder / "prop.stl")
    return folder


def quad_record(**changes) -> dict:
    """Return the record of the meshes of `write_quad`."""
    hubs = {
        "front right": (0.1, -0.1, "ccw"),
        "rear right": (-0.1, -0.1, "cw"),
        "rear left": (-0.1, 0.1, "ccw"),
        "front left": (0.1, 0.1, "cw"),
    }
    parts = {"body": {"kind": "body", "meshes": [{"file": "body.stl"}]}}
    for name, (x, y, sense) in hubs.items():
        parts[name] = {
            "kind": "rotor",
            "meshes": [{"file": "prop.stl", "move": [x, y, 0.04]}],
            "sense": sense,
        }
    return {
        "unit": "m",
        "up": "z",
        "front": "x",
        "size_is": "motor diagonal",
        "parts": parts,
    } | changes


def write_bird(folder: Path) -> tuple[Path, dict]:
    """Write a body with flat wings to both sides, and a stand below, in centimetres; front y, up z."""
    shapes = [box((4, 16, 4)), box((30, 6, 0.4), (0, 2, 0)), box((1, 1, 6), (0, 0, -6))]
    trimesh.util.concatenate(shapes).export(folder / "bird.obj")
    parts = {"body": {"kind": "body", "meshes": [{"file": "bird.obj"}]}}
    for side, sign in (("right", 1), ("left", -1)):
        edges = sorted([sign * 0.021, sign * 0.08])
        inner = [[edges[0], None, -0.01], [edges[1], None, 0.01]]
        outer = (
            [[0.08, None, None], [None, None, None]]
            if sign > 0
            else [[None, None, None], [-0.08, None, None]]
        )
        parts[f"{side} inner"] = {
            "kind": "wing",
            "region": {"box": inner},
            "hinge": [sign * 0.02, 0, 0],
        }
        parts[f"{side} outer"] = {
            "kind": "wing",
            "region": {"box": outer},
            "hinge": [sign * 0.08, 0, 0],
        }
        parts[f"{side} outer"]["parent"] = f"{side} inner"
    record = {"unit": "cm", "up": "z", "front": "y", "size_is": "length", "parts": parts}
    return folder, record | {"drop": [{"box": [[None, None, None], [None, None, -0.0205]]}]}


def car_record(**wheel) -> dict:
    """Return the record of a car.obj whose wheels are regions of the mesh, or made where `wheel`
    gives their size.
    """
    parts = {"body": {"kind": "body", "meshes": [{"file": "car.obj"}]}}
    for name, x, y in (("fl", -0.8, 1.4), ("fr", 0.8, 1.4), ("rl", -0.8, -1.4), ("rr", 0.8, -1.4)):
        region = {"box": [[x - 0.2, y - 0.4, -0.1], [x + 0.2, y + 0.4, 0.7]], "whole": True}
        parts[name] = {"kind": "wheel", "region": region}
        if wheel:
            parts[name] = {"kind": "wheel", "wheel": wheel, "hinge": [x, y, 0.33]}
    return {"unit": "m", "up": "z", "front": "y", "parts": parts, "points": 400}


HUBS = [(0.12, 0.1), (0.12, -0.1), (-0.12, 0.1), (-0.12, -0.1)]


def quadrotor(blades: bool, scale: float = 1.0) -> trimesh.Trimesh:
    """A quadrotor as one mesh, front along x, its propellers whole or of two blades each that touch
    nothing.
    """
    shapes = [box((0.22, 0.12, 0.06))]
    for x, y in HUBS:
        halves = [(0.03, 0, 0.05), (-0.03, 0, 0.05)] if blades else [(0, 0, 0.05)]
        for offset in halves:
            shapes.append(box((0.058 if blades else 0.12, 0.012, 0.004), np.add((x, y, 0), offset)))
    whole = trimesh.util.concatenate(shapes)
    whole.apply_scale(scale)
    return whole
