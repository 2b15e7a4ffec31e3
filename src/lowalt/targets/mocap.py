"""Recordings: from CMU's skeleton and motion files to a cyclic track of the 31 nodes.

`mocap_files` reads the files, `mocap_motion` turns the bones, `mocap_cycle` finds and closes the best cycle. This
module checks records and makes a cloud of the published height from the cycle. Axes of the result: x right, y front,
z up, metres.
"""

from pathlib import Path

import numpy as np

from lowalt.common import portable
from lowalt.common.classes import like
from lowalt.common.errors import InputError
from lowalt.common.files import sha256
from lowalt.targets import record_schema
from lowalt.targets.cloud import Cloud
from lowalt.targets.gait import stance_speed_mps
from lowalt.targets.input_files import check_file_name
from lowalt.targets.mocap_cycle import closed, find_cycle, refuse_short
from lowalt.targets.mocap_files import read_motion, read_skeleton
from lowalt.targets.mocap_motion import front, nodes_m, posed, refuse_glitches
from lowalt.targets.skeleton import NODES, node_cloud, stature_m

KEYS = record_schema.keys("mocap")
"""Keys of a recording's record in addition to those of every record; the key `where` says where to get the files."""


def check_record(merged: dict, extra: dict, where: str) -> dict:
    """Return the merged record of a recording after checking it and filling in defaults.

    Defaults: 120 Hz; scaled to the published height; nodes accelerate by at most 1500 m/s2; the ends of the cycle
    differ by at most 0.15 m. `first_frame` and `last_frame` count from 1 and are both used; None means the last frame
    of the file.

    `extra` are the keys of the record as written that are not common to all sources.
    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    unknown, missing = sorted(set(extra) - set(KEYS)), sorted({"skeleton", "motion"} - set(extra))
    if unknown or missing:
        raise InputError(f"{where}: unknown keys {unknown}, missing keys {missing}, expected some of {sorted(KEYS)}")
    if like(merged) != "Pedestrian":
        raise InputError(f"{where}: source is 'mocap' for a target like a {like(merged)}, expected builtin or mesh")
    defaults = {
        "first_frame": 1,
        "last_frame": None,
        "rate_hz": 120,
        "scale": "published",
        "max_acceleration_mps2": 1500,
        "max_mismatch_m": 0.15,
    }
    result = defaults | merged | {"points": len(NODES)}
    for key in ("skeleton", "motion"):
        check_file_name(result[key], f"{where}: {key}")
    first, last = result["first_frame"], result["last_frame"]
    if not (isinstance(first, int) and first >= 1 and (last is None or (isinstance(last, int) and last > first))):
        raise InputError(
            f"{where}: first_frame {first!r}, last_frame {last!r}, expected frame numbers from 1, in order"
        )
    for key in ("rate_hz", "max_acceleration_mps2"):
        if isinstance(result[key], bool) or not isinstance(result[key], (int, float)) or not 1 <= result[key] <= 1e5:
            raise InputError(f"{where}: {key} is {result[key]!r}, expected a number from 1 to 100000")
    mismatch = result["max_mismatch_m"]
    if isinstance(mismatch, bool) or not isinstance(mismatch, (int, float)) or not 0 < mismatch <= 10:
        raise InputError(f"{where}: max_mismatch_m is {mismatch!r}, expected metres, more than 0 and at most 10")
    if result["scale"] not in ("published", "none"):
        raise InputError(f"{where}: scale is {result['scale']!r}, expected published or none")
    return result


def record_files(record: dict) -> list[str]:
    """Return the user's files that a recording's record names, relative to the folder of inputs."""
    return [record["skeleton"], record["motion"]]


def mocap_cloud(record: dict, inputs_dir: str | Path, seed: int) -> Cloud:
    """Return the cloud of a recording: its best cycle on the 31 nodes, which faces +y and stays in its place.

    `record` is a merged record that `check_record` has passed; its files are relative to `inputs_dir`. The cloud's
    record says which frames were used, the mismatch that the fade closes (m), speed, scale and the height of the
    origin above ground. The uniform drift is taken out; the bob and sway of the root stay. Nothing is drawn at random:
    the record keeps `seed`, and nothing else depends on it.
    Raises: InputError naming file and frame for a faulty recording, and where it does not move.
    """
    paths = [Path(inputs_dir) / name for name in record_files(record)]
    skeleton = read_skeleton(paths[0])
    first = record["first_frame"]
    motion = posed(skeleton, read_motion(paths[1], skeleton, first, record["last_frame"]), record["rate_hz"])
    refuse_glitches(nodes_m(motion), motion.rate_hz, record["max_acceleration_mps2"], str(paths[1]), first)
    refuse_short(len(motion.root_m), motion.rate_hz, str(paths[1]))
    start, end, fade, mismatch = find_cycle(motion)
    if mismatch > record["max_mismatch_m"]:
        raise InputError(
            f"{paths[1]}: the best cycle, frames {first + start} to {first + end - 1}, closes to {mismatch:.3f} m "
            f"(root mean square over the nodes), expected at most max_mismatch_m = {record['max_mismatch_m']} m: "
            "choose first_frame and last_frame around a steady gait"
        )
    cycle, drift = closed(motion, start, end, fade)
    looped = nodes_m(cycle)
    seam = np.concatenate([looped, looped[:2]])
    refuse_glitches(
        seam, motion.rate_hz, record["max_acceleration_mps2"], f"{paths[1]} (its closed cycle)", first + start
    )
    speed = float(portable.norm(drift))
    if speed < 0.05:
        raise InputError(f"{paths[1]}: moves {speed:.3f} m/s, expected a walk or run to turn to the front")
    stature = stature_m(motion.bones_m)
    scale = record["published"]["hgt_m"] / stature if record["scale"] == "published" else 1.0
    track = nodes_m(front(cycle, drift)) * scale
    sums = {name: sha256(path) for name, path in zip(record_files(record), paths, strict=True)}
    facts = {
        "track_rate_hz": float(motion.rate_hz), "cycle_s": len(track) / motion.rate_hz,
        "track_speed_mps": speed * scale, "frames_used": [first + start, first + end - 1], "fade_frames": fade,
        "loop_mismatch_m": mismatch * scale, "recorded_stature_m": stature, "scale_factor": scale,
        "origin_height_m": float(-track[..., 2].min()),
        "stance_foot_speed_mps": stance_speed_mps(track, motion.rate_hz, speed * scale),
        "files_sha256": sums, "checksum": sums[record["motion"]], "seed": seed,
    }  # fmt: skip
    return node_cloud(track, record | facts)
