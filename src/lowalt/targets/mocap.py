"""Recordings: from CMU's skeleton and motion files to a cyclic track of the 31 nodes.

`mocap_files` reads the files, `mocap_motion` turns the bones, finds and closes the best cycle. This
module checks records and makes a cloud of the published height from the cycle. Axes of the result:
x right, y front, z up, metres.
"""

from pathlib import Path

import numpy as np

from lowalt.config.classes import like
from lowalt.files.atomic import sha256
from lowalt.files.errors import InputError, warn
from lowalt.numerics import portable
from lowalt.targets import mocap_motion
from lowalt.targets.cloud import Cloud
from lowalt.targets.gait import stance_speed_mps
from lowalt.targets.mocap_files import read_motion, read_skeleton
from lowalt.targets.mocap_joints import moved, read_bvh, read_joints, to_nodes
from lowalt.targets.record_schema import record_files
from lowalt.targets.skeleton import NODES, node_cloud, stature_m

CMU_HZ = 120
"""Rate of CMU's recordings, which their files do not say."""

LONG = 20
"""A recording of more than this many cycles gives a warning, as it may hold other motions."""
SLOWEST_MPS = 0.05
"""A recording that drifts slower than this has no direction that could be turned to the front."""


def check_record(merged: dict, where: str) -> dict:
    """Return the merged record of a recording after checking it and filling in defaults.

    Defaults: the rate that the file says, or CMU's 120 Hz; scaled to the published height; nodes
    accelerate by at most 1500 m/s2; the ends of the cycle differ by at most 0.15 m. `first_frame`
    and `last_frame` count from 1 and are both used; None means the last frame of the file.

    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    if merged["motion"].lower().endswith(".amc") and "skeleton" not in merged:
        raise InputError(f"{where}: skeleton is missing, expected the .asf of {merged['motion']}")
    if like(merged) != "Pedestrian":
        raise InputError(
            f"{where}: source is 'mocap' for a target like a {like(merged)}, expected builtin or "
            "mesh"
        )
    defaults = {
        "first_frame": 1,
        "last_frame": None,
        "scale": "published",
        "max_acceleration_mps2": 1500,
        "max_mismatch_m": 0.15,
    }
    result = defaults | merged | {"points": len(NODES)}
    first = result["first_frame"]
    last = result["last_frame"]
    if last is not None and last <= first:
        raise InputError(
            f"{where}: first_frame {first}, last_frame {last}, expected frame numbers in order"
        )
    return result


def _read(paths: list[Path], record: dict) -> tuple[mocap_motion.Motion, int]:
    """Return the motion of a record's files, and the number of its first frame.

    Raises: InputError naming the file: another format, a rate that neither it nor the record says.
    """
    path = paths[-1]
    first = record["first_frame"]
    last = record["last_frame"]
    kind = path.suffix.lower()
    if kind == ".amc":
        skeleton = read_skeleton(paths[0])
        channels, first = read_motion(path, skeleton, first, last)
        return mocap_motion.posed(skeleton, channels, record.get("rate_hz", CMU_HZ)), first
    if kind not in (".bvh", ".npz"):
        raise InputError(f"{path}: format {kind!r}, expected .amc with its skeleton, .bvh or .npz")
    joints, rate = read_bvh(path) if kind == ".bvh" else read_joints(path)
    nodes = to_nodes(joints, str(path))[first - 1 : last]
    rate = record.get("rate_hz", rate)
    if rate is None:
        raise InputError(f"{path}: says no rate, expected rate_hz in the record")
    # A BVH has no unit: its person gets the published height.
    height = record["published"]["hgt_m"] if kind == ".bvh" else None
    return moved(nodes, rate, height, str(path)), first


def mocap_cloud(record: dict, inputs_dir: str | Path, seed: int) -> Cloud:
    """Return the cloud of a recording: its best cycle on the 31 nodes, which faces +y.

    `record` is a merged record that `check_record` has passed; its files are relative to
    `inputs_dir`. The cloud's record says which frames were used, the mismatch that the fade closes
    (m), speed, scale and the height of the origin above ground. The uniform drift is taken out, so
    that the body stays where it is; the bob and sway of the root stay. Nothing is drawn at random:
    the record keeps `seed`, and nothing else depends on it.
    Raises: InputError naming file and frame for a faulty recording, and where it does not move.
    """
    paths = [Path(inputs_dir) / name for name in record_files(record)]
    where = str(paths[-1])
    motion, first = _read(paths, record)
    rate_hz = motion.rate_hz
    most = record["max_acceleration_mps2"]
    mocap_motion.refuse_glitches(mocap_motion.nodes_m(motion), rate_hz, most, where, first)
    mocap_motion.refuse_short(len(motion.root_m), rate_hz, where)
    start, end, fade, mismatch = mocap_motion.find_cycle(motion)
    if mismatch > record["max_mismatch_m"]:
        raise InputError(
            f"{where}: the best cycle, frames {first + start} to {first + end - 1}, closes to "
            f"{mismatch:.3f} m (root mean square over the nodes), expected at most max_mismatch_m "
            f"= {record['max_mismatch_m']} m: choose first_frame and last_frame around a steady "
            "gait"
        )
    cycle, drift = mocap_motion.closed(motion, start, end, fade)
    looped = mocap_motion.nodes_m(cycle)
    seam = np.concatenate([looped, looped[:2]])
    mocap_motion.refuse_glitches(seam, rate_hz, most, f"{where} (its closed cycle)", first + start)
    speed = float(portable.norm(drift))
    if speed < SLOWEST_MPS:
        raise InputError(
            f"{where}: moves {speed:.3f} m/s, expected a walk or run to turn to the front"
        )
    stature = stature_m(motion.bones_m)
    scale = record["published"]["hgt_m"] / stature if record["scale"] == "published" else 1.0
    track = mocap_motion.nodes_m(mocap_motion.front(cycle, drift)) * scale
    # An AMC file says no rate, so that one of another rate would walk at the wrong speed.
    if "rate_hz" not in record and where.lower().endswith(".amc"):
        mocap_motion.refuse_strange_rate(track, rate_hz, speed * scale, stature * scale, where)
    if len(motion.root_m) > LONG * (end - start):
        text = (
            f"{where}: of {len(motion.root_m)} frames {first + start} to {first + end - 1} are "
            "used, which close best"
        )
        warn(f"{text}; first_frame and last_frame choose others")
    sums = {name: sha256(path) for name, path in zip(record_files(record), paths, strict=True)}
    facts = {
        "track_rate_hz": float(rate_hz),
        "cycle_s": len(track) / rate_hz,
        "track_speed_mps": speed * scale,
        "frames_used": [first + start, first + end - 1],
        "fade_frames": fade,
        "loop_mismatch_m": mismatch * scale,
        "recorded_stature_m": stature,
        "scale_factor": scale,
        "origin_height_m": float(-track[..., 2].min()),
        "stance_foot_speed_mps": stance_speed_mps(track, rate_hz, speed * scale),
        "files_sha256": sums,
        "checksum": sums[record["motion"]],
        "seed": seed,
    }
    return node_cloud(track, record | facts)
