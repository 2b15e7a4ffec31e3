"""Awkward meshes of one quadrotor, a car and a bird: units, axes, names in every order, groups, instances, file names.

Every quadrotor is the same craft, 0.24 m by 0.2 m between its motors, so all its clouds have the same hinges.
"""

from pathlib import Path

import numpy as np
import trimesh

from meshes import box

HUBS = {"front left": (0.12, 0.1), "front right": (0.12, -0.1), "rear left": (-0.12, 0.1), "rear right": (-0.12, -0.1)}
"""Motors of the craft in its own axes: x to the front, y to the left."""
SIZE_M = float(np.hypot(0.24, 0.2))
ROW = {"category": "UAV", "size_m": SIZE_M, "n_rotors_or_wings": 4, "freq_lo_hz": 60, "freq_hi_hz": 90,
       "vx_abs_max": 9, "vy_abs_max": 9, "vz_abs_max": 3, "points_in_published_cloud_approx": 120}  # fmt: skip
METRES = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254, "ft": 0.3048}
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def body():
    """The craft's body."""
    return box((0.22, 0.12, 0.06))


def propeller(hub=(0.0, 0.0), height=0.05):
    """A propeller of two blades above a hub."""
    return box((0.12, 0.012, 0.004), (*hub, height))


def direction(axis):
    """The unit vector of an axis such as "-x"."""
    return np.array(AXES[axis[-1]], float) * (-1 if axis[0] == "-" else 1)


def turned(up, front):
    """The matrix from the craft's axes to those of a file whose axes `up` and `front` point up and to the front."""
    return np.stack([direction(front), np.cross(direction(up), direction(front)), direction(up)], 1)


def letter(vector):
    """The axis along which a vector points, either way."""
    return "xyz"[int(np.abs(vector).argmax())]


def record(unit, up="z", front="x", **more):
    """The record of the craft in a file of this unit and these axes."""
    return {
        "row": dict(ROW),
        "source": "mesh",
        "unit": unit,
        "up": up,
        "front": front,
        "size_is": "motor diagonal",
    } | more


def cut(folder, name, unit="m", up="z", front="x", file=None, **more):
    """One whole mesh whose propellers are cut out of it by cylinders; regions in metres along the file's axes."""
    whole = trimesh.util.concatenate([body(), *(propeller(hub) for hub in HUBS.values())])
    matrix = np.eye(4)
    matrix[:3, :3] = turned(up, front)
    whole.apply_transform(matrix)
    whole.apply_scale(1 / METRES.get(unit, unit))
    file = file or f"{name}.stl"
    (folder / file).parent.mkdir(parents=True, exist_ok=True)
    whole.export(folder / file)
    parts = {"body": {"kind": "body", "meshes": [{"file": file}]}}
    for word, hub in HUBS.items():
        centre = matrix[:3, :3] @ [*hub, 0.05]
        region = {"centre": centre.tolist(), "axis": letter(direction(up)), "radius": 0.07, "half_length": 0.01}
        parts[f"{word} rotor"] = {"kind": "rotor", "region": {"cylinder": region}}
    return record(unit, up, front, parts=parts, **more)


def renamed(folder, name, words):
    """The cut craft with the names `words` for its body and rotors: names whose order says nothing."""
    found = cut(folder, name)
    found["parts"] = dict(sorted(zip(words, found["parts"].values(), strict=True)))
    return found


def separate(folder, name, unit="m", by_part=None):
    """A body and one propeller in files of their own; the propeller is moved to each motor."""
    scale, other = 1 / METRES[unit], by_part or unit
    (folder / "pieces").mkdir(exist_ok=True)
    body().apply_scale(scale).export(folder / f"pieces/{name} body.ply")
    propeller().apply_scale(1 / METRES[other]).export(folder / f"pieces/{name} prop.stl")
    more = {"unit": by_part} if by_part else {}
    parts = {
        f"{word} rotor": {"kind": "rotor", "sense": "ccw" if hub[0] * hub[1] > 0 else "cw",
                          "meshes": [{"file": f"pieces/{name} prop.stl", "move": [*hub, 0.0], **more}]}
        for word, hub in HUBS.items()
    }  # fmt: skip
    return record(unit, parts={**parts, "body": {"kind": "body", "meshes": [{"file": f"pieces/{name} body.ply"}]}})


def grouped(folder, name, keyword):
    """An OBJ file whose body and propellers are groups (g) or objects (o) of one list of vertices."""
    lines, first = [], 1
    for word, shape in {"hull": body(), **{word: propeller(hub) for word, hub in HUBS.items()}}.items():
        lines += [f"v {x} {y} {z}" for x, y, z in shape.vertices] + [f"{keyword} {word.replace(' ', '_')}"]
        lines += ["f " + " ".join(str(first + corner) for corner in face) for face in shape.faces]
        first += len(shape.vertices)
    (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")
    mesh = {"file": f"{name}.obj"}
    parts = {f"{word} rotor": {"kind": "rotor", "meshes": [{**mesh, "geometry": [word.replace(" ", "_")]}]}
             for word in HUBS}  # fmt: skip
    return record("m", parts={**parts, "body": {"kind": "body", "meshes": [{**mesh, "geometry": ["hull"]}]}})


def instanced(folder, name, suffix, unit="m"):
    """A scene in which one propeller stands at four places, as instances with names of their own."""
    scene = trimesh.Scene()
    scene.add_geometry(body(), node_name="hull", geom_name="hull_geometry")
    for word, hub in HUBS.items():
        place = np.eye(4)
        place[:2, 3] = hub
        scene.add_geometry(propeller(), node_name=word.replace(" ", "_"), geom_name="propeller", transform=place)
    scene.export(folder / f"{name}{suffix}")
    mesh = {"file": f"{name}{suffix}"}
    parts = {f"{word} rotor": {"kind": "rotor", "meshes": [{**mesh, "geometry": [word.replace(" ", "_")]}]}
             for word in HUBS}  # fmt: skip
    return record(unit, parts={"body": {"kind": "body", "meshes": [{**mesh, "geometry": ["hull"]}]}, **parts})


def car(folder, name):
    """A box of a car with four made wheels whose names stand before the body's."""
    (folder / f"{name}.stl").parent.mkdir(exist_ok=True)
    box((4.0, 1.6, 1.0), (0, 0, 0.8)).export(folder / f"{name}.stl")
    row = {"category": "Vehicle", "n_rotors_or_wings": 4, "len_m": 4.0, "wid_m": 1.7, "hgt_m": 1.3, "wheel_diam_m": 0.6,
           "speed_lo": 1, "speed_hi": 20, "points_in_published_cloud_approx": 150}  # fmt: skip
    made = {"kind": "wheel", "wheel": {"diameter_m": 0.6, "width_m": 0.2}}
    wheels = {f"{end} {side}": {**made, "hinge": [x, y, 0.3]}
              for end, x in (("back", -1.3), ("ahead", 1.3)) for side, y in (("left", 0.7), ("right", -0.7))
              }  # fmt: skip
    parts = {**wheels, "coachwork": {"kind": "body", "meshes": [{"file": f"{name}.stl"}]}}
    return {"row": row, "source": "mesh", "unit": "m", "up": "z", "front": "x", "parts": parts}


def bird(folder, name):
    """A bird of boxes: outer wings sort before the inner wings that they ride on."""
    shapes = {"trunk": box((0.4, 0.1, 0.1)), "in": box((0.12, 0.25, 0.01)), "out": box((0.08, 0.25, 0.008))}
    for word, shape in shapes.items():
        shape.export(folder / f"{name}-{word}.stl")
    row = {"category": "Bird", "size_m": 0.4, "n_rotors_or_wings": 2, "freq_lo_hz": 3, "freq_hi_hz": 5, "vx_abs_max": 8,
           "vy_abs_max": 8, "vz_abs_max": 5, "points_in_published_cloud_approx": 120}  # fmt: skip
    parts = {"trunk": {"kind": "body", "meshes": [{"file": f"{name}-trunk.stl"}]}}
    for side, sign in (("left", 1), ("right", -1)):
        inner = {"file": f"{name}-in.stl", "move": [0.05, 0.165 * sign, 0]}
        outer = {"file": f"{name}-out.stl", "move": [0.05, 0.405 * sign, 0]}
        parts[f"z {side} shoulder"] = {"kind": "wing", "hinge": [0.05, 0.05 * sign, 0.0], "meshes": [inner]}
        tip = {"kind": "wing", "hinge": [0.05, 0.29 * sign, 0.0], "meshes": [outer]}
        parts[f"a {side} tip"] = tip | {"parent": f"z {side} shoulder"}
    return {"row": row, "source": "mesh", "unit": "m", "up": "z", "front": "x", "size_is": "length", "parts": parts}


CASES = {
    **{f"in {unit}": (cut, {"unit": unit}) for unit in ("mm", "cm", "in", "ft", 0.05)},
    **{f"up {up} front {front}": (cut, {"up": up, "front": front})
       for up, front in (("y", "z"), ("-z", "x"), ("x", "-y"), ("z", "-y"), ("-y", "-x"))},
    "rotors before body": (renamed, {"words": ["tail", "a1", "a2", "a3", "a4"]}),
    "digits and capitals": (renamed, {"words": ["Rumpf", "1", "10", "2", "arm_9"]}),
    "names with signs": (renamed, {"words": ["m.body", "b-1", "b.2", "B 3", "b_4"]}),
    "names that grow": (renamed, {"words": ["x", "xx", "xxx", "xxxx", "a body"]}),
    "separate files": (separate, {}), "separate in inches": (separate, {"unit": "in"}),
    "units by part": (separate, {"unit": "mm", "by_part": "cm"}),
    "groups": (grouped, {"keyword": "g"}), "objects": (grouped, {"keyword": "o"}),
    "instances in GLB": (instanced, {"suffix": ".glb"}),
    "a file name with signs": (cut, {"file": "odd folder/my craft (1), new.stl"}),
    "a ply in a folder": (cut, {"unit": "cm", "file": "deep/er/craft.ply"}),
    "Box car": (car, {}), "Box bird": (bird, {}),
}  # fmt: skip
"""Each awkward target by the name of its subtype: what writes it, and how."""


def written(folder: Path, names=tuple(CASES)) -> dict:
    """Write the meshes of some cases below `folder`; returns their records, the last one first."""
    folder.mkdir(parents=True, exist_ok=True)
    found = {name: CASES[name][0](folder, name.replace(" ", "_"), **CASES[name][1]) for name in names}
    return dict(reversed(found.items()))
