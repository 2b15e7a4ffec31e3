"""A skeleton file and a made-up walk in the ASF/AMC format: inputs of tests of recordings."""

import math
from pathlib import Path

import numpy as np

from lowalt.targets import mocap, record_schema
from lowalt.targets.cloud import Cloud, check
from lowalt.targets.skeleton import LIMBS, NODES

CHANNELS = {
    "lfemur": "rx ry rz",
    "ltibia": "rx",
    "rfemur": "rx ry rz",
    "rtibia": "rx",
    "lhumerus": "rx ry rz",
}
PUBLISHED = {"hgt_m": 1.75}
BVH = """HIERARCHY
ROOT Hips { OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
JOINT Spine { OFFSET 0 2 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 3 0 } } }
MOTION
Frames: 2
Frame Time: 0.02
1 2 3 90 0 0 0 90 0
0 0 0 0 0 0 90 0 0
"""


def asf(bones: dict[str, np.ndarray], extra: str = "") -> str:
    """The text of a skeleton file with these bones (x, y, z)."""
    lines = [
        ":version 1.10",
        ":units",
        "length 0.45",
        "angle deg",
        ":root",
        "order TX TY TZ RX RY RZ",
        "axis XYZ",
    ]
    lines += ["position 0 0 0", "orientation 0 0 0", ":bonedata"]
    for name in NODES[1:]:
        x, y, z = bones[name]
        lines += [
            "begin",
            f"name {name}",
            f"direction {x} {y} {z}",
            f"length {math.hypot(x, y, z)!r}",
        ]
        lines += (
            ["axis 0 0 0 XYZ"] + ([f"dof {CHANNELS[name]}"] if name in CHANNELS else []) + ["end"]
        )
    lines += [":hierarchy", "begin"]
    for parent in NODES:
        children = [child for child, above in LIMBS.items() if above == parent]
        lines += [" ".join([parent, *children])] if children else []
    return "\n".join([*lines, "end", extra])


def walk(
    frames: int, period: float = 100, turn_deg: float = 0.0, speed: float = 0.2, growth: float = 0.0
) -> str:
    """A made-up walk: sinusoidal angles, growing a frame by `growth`; the root moves along z turned
    about y.
    """
    lines = [":FULLY-SPECIFIED", ":DEGREES"]
    heading = math.radians(turn_deg)
    for frame in range(frames):
        swing = math.sin(2 * math.pi * frame / period) * (1 + growth * frame)
        way = speed * frame
        lines += [str(frame + 1)]
        lines += [
            f"root {way * math.sin(heading)!r} {16 + 0.3 * swing**2!r} {way * math.cos(heading)!r}"
            f" 0 {turn_deg!r} 0"
        ]
        lines += [
            f"lfemur {30 * swing!r} 0 0",
            f"rfemur {-30 * swing!r} 0 0",
            f"lhumerus {-20 * swing!r} 5 0",
        ]
        lines += [f"ltibia {20 - 20 * swing!r}", f"rtibia {20 + 20 * swing!r}"]
    return "\n".join(lines)


def write_files(folder: Path) -> Path:
    """Write a skeleton s.asf and a walk m.amc of 260 frames into a folder; return the folder."""
    rng = np.random.default_rng(5)
    bones = {name: rng.normal(size=3) for name in LIMBS}
    bones |= {
        "lfemur": np.array([0, -7.0, 0]),
        "rfemur": np.array([0, -7.0, 0]),
        "ltibia": np.array([0, -7.0, 0]),
    }
    bones |= {
        "rtibia": np.array([0, -7.0, 0]),
        "lfoot": np.array([0, -1.0, 2]),
        "rfoot": np.array([0, -1.0, 2]),
    }
    (folder / "s.asf").write_text(asf(bones))
    (folder / "m.amc").write_text(walk(260))
    return folder


def cloud_of(folder: Path, **changes) -> Cloud:
    """Return the checked cloud of a record of the folder's files, with some keys changed."""
    record = {
        "subtype": "Walking Pedestrian 1",
        "category": "Pedestrian",
        "published": PUBLISHED,
        "source": "mocap",
        "rcs_m2_per_point": 1.0,
        "points": 30,
    }
    # The walk is made up: its steps are too quick for their length, so the rate is said.
    extra = {"skeleton": "s.asf", "motion": "m.amc", "rate_hz": 120} | changes
    extra = {key: value for key, value in extra.items() if value is not None}
    record |= {"published": extra.pop("published", PUBLISHED)}
    record_schema.check("mocap", extra, "record")
    record = mocap.check_record(record | extra, "record")
    return check(mocap.mocap_cloud(record, folder, 3), "cloud")
