"""The authors' pedestrians, read from their videos: paths of the 31 nodes over a cycle, and
lengths, angles and steps.

All dots have one colour. `starts.csv` tells by eye which dot of the first frame is which node, and
each node is followed from there. One view gives two coordinates of a node. The third follows from
the gait: the left half of the body does what the right half does, mirrored and half a cycle later,
so both halves together are one half seen from two directions, 60 degrees apart. The paths are
Fourier series in the time, so that all this is one linear fit; the cycle's duration is searched
for, and the front is +y, as the paper says. What then is left is added to each side in the plane of
the picture, so a person need not be as even as that; only depth is.

`python pedestrians.py FOLDER` says how far off all this is: it draws four of CMU's recordings in
FOLDER (`SUBJECT/*.amc`) as the authors would and reads them back.
"""

import sys
from collections.abc import Iterable
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.optimize import minimize_scalar
from scipy.spatial import cKDTree

from lowalt.targets.mocap_files import read_motion, read_skeleton
from lowalt.targets.mocap_motion import front, nodes_m, posed
from lowalt.targets.skeleton import NODES, PARENTS


def other(name: str) -> str:
    """Return the node of the other side of the body; a node of the middle is its own."""
    mirrored = {"l": "r", "r": "l"}.get(name[0], name[0]) + name[1:]
    return mirrored if mirrored in NODES else name


MIRRORED = np.array([NODES.index(other(name)) for name in NODES])
MIRROR = np.diag([-1.0, 1, 1])
TRUNK = ("lhipjoint", "rhipjoint", "lowerback", "upperback", "thorax")
HARMONICS = 5
PHASES = 32
"""Moments of a cycle at which paths are given."""
BLUE = (0, 114, 189)
CYCLES_S = (1.5, 6.0)
"""Durations of a cycle in the videos that are tried."""
SLOWER = 4
"""Times by which the videos are slower than the recordings, if each of their 30 frames a second is
one of CMU's 120.
"""
LONGEST_SHANK_PIXELS = 72
STRAY_PIXELS = 5.0
"""Distance (pixels) beyond which a dot counts less, since it may be another node's."""
PASSES = 2
VIEW = np.array([[138.0, -106, 0], [-37, -49, -106]])
"""About how the authors' pictures show a metre of x, y and z, in pixels."""
ERRORS = {
    "highest to lowest node": 0.02,
    "thigh": 0.015,
    "shank": 0.01,
    "upper arm": 0.01,
    "forearm": 0.03,
    "stride": 0.25,
    "step": 0.03,
    "trunk": 3,
    "hip": 2,
    "knee": 8,
    "ankle": 8,
    "shoulder": 10,
    "elbow": 15,
    "hand's path": 0.08,
    "ankle's path": 0.025,
}
"""Errors (m or degrees) of what is measured: about twice what `main` finds, since here dots are
also followed, and more where the dots are more than 3 pixels away from their paths."""


def dot_pixels(frame: np.ndarray) -> np.ndarray:
    """Return the pixels (K, 2), column and row, that belong to dots around a person."""
    inside = frame[250:750, 400:850].astype(int)
    mask = ndimage.binary_opening(((inside - BLUE) ** 2).sum(2) < 120**2, np.ones((3, 3)))
    return np.argwhere(mask)[:, ::-1] + [400, 250]


def followed(
    pixels: list[np.ndarray], times: np.ndarray, start: np.ndarray, model: np.ndarray | None = None
) -> np.ndarray:
    """Return the places (F, 31, 2) of the nodes in frames, from their dots' pixels in each and
    their first places.

    A node is expected where its speed leads, or where a model (F, 31, 2) has it, and belongs to the
    blob of dots that is nearest then; a blob without a node takes the nearest one of a blob that
    has several. Inside a blob each pixel belongs to its nearest node. The speed follows what is
    seen, less where a blob has several nodes. The root stays in its place, and the nodes around it
    move little.
    """
    places = [np.array(start, float)]
    near = [NODES.index(name) for name in TRUNK]
    speed = np.zeros_like(places[0])
    before = times[0]
    for number, (shown, now) in enumerate(zip(pixels, times, strict=True)):
        if model is None:
            expected = places[-1] + speed * (now - before)
            expected[near] = (places[-1][near] + start[near]) / 2
        else:
            expected = model[number]
        seen, alone = in_blobs(shown, expected)
        seen = in_order(two_feet(seen, expected) if model is None else seen)
        seen[0] = start[0]
        if now > before:
            surprise = (seen - expected) / (now - before)
            speed = speed + np.where(alone, 0.5, 0.1)[:, None] * surprise
        places.append(seen)
        before = now
    return np.array(places[1:])


def two_feet(places: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return places (31, 2) with the six dots of the feet shared out anew: three near each other,
    no shank too long, and the feet near to where they are expected (31, 2)."""
    left, right = (
        [NODES.index(side + name) for name in ("tibia", "foot", "toes")] for side in "lr"
    )
    both = np.array(left + right)
    best = (np.inf, None)
    for chosen in combinations(range(6), 3):
        cost = 0.0
        shared = [both[list(chosen)], both[[place for place in range(6) if place not in chosen]]]
        for nodes, foot in zip(shared, (left, right), strict=True):
            apart = np.linalg.norm(places[nodes][:, None] - places[nodes], axis=2)
            shank = np.linalg.norm(places[nodes] - places[foot[0] - 1], axis=1).min()
            cost += apart.sum() / 6 + 10 * max(0.0, shank - LONGEST_SHANK_PIXELS)
            cost += 0.5 * np.linalg.norm(places[nodes].mean(0) - expected[foot].mean(0))
        if cost < best[0]:
            best = cost, shared
    result = places.copy()
    for nodes, foot in zip(best[1], (left, right), strict=True):
        if set(nodes) != set(foot):
            result[foot] = places[nodes]
    return result


def in_order(places: np.ndarray) -> np.ndarray:
    """Return places (31, 2) with the three dots of each foot and the two of each forearm in their
    order.

    Ankle, ball and toes lie about in line, twice as far apart from ankle to ball as from ball to
    toes.
    """
    for side in "lr":
        foot = [NODES.index(side + name) for name in ("tibia", "foot", "toes")]
        apart = np.linalg.norm(places[foot][:, None] - places[foot], axis=2)
        ball = apart.sum(1).argmin()
        toes, ankle = sorted(set(range(3)) - {ball}, key=apart[ball].__getitem__)
        if (
            apart[ball, ankle] > 1.4 * apart[ball, toes]
            and apart[ankle, toes] > 1.3 * apart[ball, ankle]
        ):
            places[foot] = places[[foot[ankle], foot[ball], foot[toes]]]
        elbow = NODES.index(side + "humerus")
        arm = [NODES.index(side + name) for name in ("radius", "wrist")]
        places[arm] = places[
            sorted(arm, key=np.linalg.norm(places - places[elbow], axis=1).__getitem__)
        ]
    return places


def in_blobs(shown: np.ndarray, expected: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the places (31, 2) of nodes in the pixels (K, 2) of a frame's dots, nearest to where
    they are expected, and which (31,) have a blob of their own."""
    first = shown.min(0)
    mask = np.zeros(np.ptp(shown, axis=0) + 1, bool)
    mask[tuple((shown - first).T)] = True
    runs, count = ndimage.label(mask)
    blob = runs[tuple((shown - first).T)] - 1
    blobs = [shown[blob == number] for number in range(count)]
    away = np.array([cKDTree(inside).query(expected)[0] for inside in blobs])
    owner = away.argmin(0)
    for number in range(count):
        shared = np.bincount(owner, minlength=count)[owner] > 1
        if number not in owner and shared.any():
            owner[np.flatnonzero(shared)[away[number, shared].argmin()]] = number
    places = expected.copy()
    for number, inside in enumerate(blobs):
        nodes = np.flatnonzero(owner == number)
        if len(nodes) == 1:
            places[nodes] = inside.mean(0)
            continue
        for _ in range(3 * (len(nodes) > 1)):
            away = ((inside[:, None] - places[None, nodes]) ** 2).sum(2)
            nearest = away.argmin(1)
            for place, node in enumerate(nodes):
                own = (
                    inside[nearest == place]
                    if (nearest == place).any()
                    else inside[[away[:, place].argmin()]]
                )
                places[node] = own.mean(0)
    return places, np.bincount(owner, minlength=count)[owner] == 1


def series(turns: np.ndarray) -> np.ndarray:
    """Return the terms (K, 2 H + 1) of a Fourier series at times (K,) in cycles."""
    angles = 2 * np.pi * turns[:, None] * np.arange(HARMONICS + 1)
    return np.hstack([np.cos(angles), np.sin(angles[:, 1:])])


def even(
    seen: np.ndarray, view: np.ndarray, turns: np.ndarray, nodes: np.ndarray, rounds: int
) -> np.ndarray:
    """Return the coefficients (2 H + 1, 3, nodes) of paths that both halves of the body share.

    seen: (F, 31, 2) pixels from the root; view: (2, 3) pixels a metre; turns: (F,) cycles. Each
    round gives less weight to dots that are more than some pixels off, which are those of another
    node.
    """
    terms = np.vstack(
        [
            np.einsum("ft,ij->fitj", series(turns + later), view @ mirror).reshape(
                2 * len(turns), -1
            )
            for later, mirror in ((0.0, np.eye(3)), (0.5, MIRROR))
        ]
    )
    both = np.vstack(
        [
            np.swapaxes(half, 1, 2).reshape(-1, len(nodes))
            for half in (seen[:, nodes], seen[:, MIRRORED[nodes]])
        ]
    )
    found = np.linalg.lstsq(terms, both, rcond=None)[0]
    for _ in range(rounds):
        off = (terms @ found - both).reshape(-1, 2, len(nodes))
        weights = np.repeat(1 / (1 + (off**2).sum(1) / STRAY_PIXELS**2), 2, axis=0)
        for number in range(len(nodes)):
            weighted = terms * weights[:, number, None]
            found[:, number] = np.linalg.solve(weighted.T @ terms, weighted.T @ both[:, number])
    return found.reshape(-1, 3, len(nodes))


def drawn(coefficients: np.ndarray, view: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return the pixels (F, nodes, 2) from the root where paths are at times in cycles."""
    return np.einsum("ft,tjn,ij->fni", series(turns), coefficients, view)


def cycle_of(seen: np.ndarray, view: np.ndarray, times: np.ndarray) -> float:
    """Return the duration (s) of the cycle: the one that leaves least of knees, shoulders and
    elbows.
    """
    nodes = np.array(
        [NODES.index(side + name) for side in "lr" for name in ("femur", "clavicle", "humerus")]
    )

    def left(cycle: float) -> float:
        """Mean distance of the dots from paths of this cycle, each counted up to some pixels."""
        found = even(seen, view, times / cycle, nodes, 1)
        off = np.linalg.norm(drawn(found, view, times / cycle) - seen[:, nodes], axis=2)
        return float(np.minimum(off, 2 * STRAY_PIXELS).mean())

    near = min((cycle for cycle in np.geomspace(*CYCLES_S, 40) if cycle < np.ptp(times)), key=left)
    return float(
        minimize_scalar(left, bounds=(0.96 * near, 1.04 * near), options={"xatol": 1e-3 * near}).x
    )


def lifted(seen: np.ndarray, view: np.ndarray, turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients (2 H + 1, 3, 31) of the nodes' paths, and those that both halves
    would share.

    seen, view, turns: as of `even`.
    """
    shared = even(seen, view, turns, np.arange(len(NODES)), 4)
    off = seen - drawn(shared, view, turns)
    weights = 1 / (1 + (off**2).sum(2) / STRAY_PIXELS**2)
    across = off @ np.linalg.pinv(view).T
    terms = series(turns)
    own = np.zeros_like(shared)
    # Where a clip is no longer than a cycle, little would hold the rest of it: a small weight draws
    # it to zero.
    hold = 0.02 * len(turns) * np.eye(terms.shape[1])
    for node in range(len(NODES)):
        weighted = terms * weights[:, node, None]
        own[:, :, node] = np.linalg.solve(weighted.T @ terms + hold, weighted.T @ across[:, node])
    return shared + own, shared


def bone(paths: np.ndarray, name: str) -> np.ndarray:
    """Return the vectors (K, 3) from a node's parent to the node."""
    node = NODES.index(name)
    return paths[:, node] - paths[:, PARENTS[node]]


def pitch(way: np.ndarray) -> np.ndarray:
    """Return the angle (degrees) by which vectors (K, 3) point to the front, from straight down."""
    return np.degrees(np.arctan2(way[:, 1], -way[:, 2]))


def bend(upper: np.ndarray, lower: np.ndarray) -> np.ndarray:
    """Return the angle (degrees) between vectors (K, 3), 0 where they go on straight."""
    cosine = (upper * lower).sum(1) / np.linalg.norm(upper, axis=1) / np.linalg.norm(lower, axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def stride(paths: np.ndarray) -> float:
    """Return the distance (m) of one cycle on the ground, from the speed at which feet move back
    against the root.

    No part of a foot slides back on the ground, and while a foot carries the body some part of it
    stands still, so the fastest part has the body's speed; half of all moments are faster than what
    is returned.
    """
    feet = paths[
        :, [NODES.index(side + name) for side in "lr" for name in ("tibia", "foot", "toes")], 1
    ]
    back = (np.roll(feet, 1, 0) - np.roll(feet, -1, 0)) * len(paths) / 2
    return float(np.median(back.max(1)))


def measured(paths: np.ndarray) -> dict[str, tuple[float, str]]:
    """Return value and unit of each quantity of a cycle's paths (K, 31, 3)."""
    lengths = {name: np.linalg.norm(bone(paths, name), axis=1) for name in NODES[1:]}
    rows = {}
    rows["highest to lowest node, most"] = np.ptp(paths[..., 2], axis=1).max(), "m"
    for word, name in (
        ("thigh", "femur"),
        ("shank", "tibia"),
        ("upper arm", "humerus"),
        ("forearm", "radius"),
    ):
        rows[f"{word}, length"] = np.mean([lengths[side + name].mean() for side in "lr"]), "m"
    rows["stride"] = stride(paths), "m"
    ankles = [paths[:, NODES.index(side + "tibia"), 1] for side in "lr"]
    rows["step, ankles apart at most"] = abs(ankles[0] - ankles[1]).max(), "m"
    rows["trunk, lean to the front"] = (
        pitch(paths[:, NODES.index("thorax")] * [1, 1, -1]).mean(),
        "degrees",
    )
    for side, word in (("l", "left"), ("r", "right")):
        thigh, shank, foot = (bone(paths, side + name) for name in ("femur", "tibia", "foot"))
        arm, forearm = (bone(paths, side + name) for name in ("humerus", "radius"))
        for what, angle in (
            ("hip", pitch(thigh)),
            ("knee", bend(thigh, shank)),
            ("ankle", bend(shank, foot)),
            ("shoulder", pitch(arm)),
            ("elbow", bend(arm, forearm)),
        ):
            rows[f"{word} {what}, least"] = angle.min(), "degrees"
            rows[f"{word} {what}, most"] = angle.max(), "degrees"
        for what, name in (("hand", "hand"), ("ankle", "tibia")):
            for axis, line in zip("yz", paths[:, NODES.index(side + name), 1:].T, strict=True):
                rows[f"{word} {what}'s path, least {axis}"] = line.min(), "m"
                rows[f"{word} {what}'s path, most {axis}"] = line.max(), "m"
    return rows


def read(
    start: np.ndarray, view: np.ndarray, times: np.ndarray, pixels: list[np.ndarray]
) -> tuple[np.ndarray, dict]:
    """Return the paths (PHASES, 31, 3) m of a cycle, front +y, and what was found on the way.

    start: (31, 2) places of the nodes in the first frame; view: (2, 3) pixels a metre; times: (F,)
    s; pixels: those of each frame's dots.
    """
    places = followed(pixels, times, start)
    cycle = cycle_of(places - start[0], view, times)
    for number in range(PASSES):
        own, shared = lifted(places - start[0], view, times / cycle)
        # At first one half of the body corrects the other.
        model = drawn(shared if number == 0 else own, view, times / cycle) + start[0]
        places = followed(pixels, times, start, model)
    cycle = cycle_of(places - start[0], view, times)
    own, shared = lifted(places - start[0], view, times / cycle)
    off, uneven = (drawn(paths, view, times / cycle) + start[0] - places for paths in (own, shared))
    found = {"cycle": cycle, "cycles": np.ptp(times) / cycle}
    found |= {
        name: float(np.sqrt((array**2).sum(2).mean()))
        for name, array in (("off", off), ("uneven", uneven))
    }
    return np.einsum("ft,tjn->fnj", series(np.arange(PHASES) / PHASES), own), found


def readings(paths: np.ndarray, found: dict) -> list[tuple]:
    """Return (quantity, value, error, unit) of a pedestrian; for paths and findings see `read`."""
    rows = [
        ("cycle in the video", found["cycle"], 0.02 * found["cycle"], "s"),
        (
            "cycle, a frame of the video being 1/120 s",
            found["cycle"] / SLOWER,
            0.02 * found["cycle"] / SLOWER,
            "s",
        ),
        ("cycles shown", found["cycles"], 0.02 * found["cycles"], "1"),
        ("dots away from their paths", found["off"], 0.1, "pixels"),
        ("dots away from paths that both sides share", found["uneven"], 0.1, "pixels"),
    ]
    for what, (value, unit) in measured(paths).items():
        error = ERRORS[what.split(",")[0].removeprefix("left ").removeprefix("right ")] * max(
            1, found["off"] / 3
        )
        rows.append((what, value, error, unit))
        if what == "stride":
            rows.append(
                (
                    "forward speed, likewise",
                    *(part / found["cycle"] * SLOWER for part in (value, error)),
                    "m/s",
                )
            )
    return rows


def recordings(folder: Path) -> Iterable[tuple[str, np.ndarray]]:
    """Yield name and nodes (F, 31, 3) m from the root, front +y, of four of CMU's walks and runs in
    a folder.
    """
    for path in (
        folder / name[:2] / f"{name}.amc" for name in ("02_01", "02_03", "07_01", "09_01")
    ):
        skeleton = read_skeleton(path.with_name(f"{path.parent.name}.asf"))
        channels, _ = read_motion(path, skeleton)
        motion = posed(skeleton, channels, 120)
        nodes = nodes_m(front(motion, motion.root_m[-1, :2] - motion.root_m[0, :2]))
        yield path.stem, nodes - nodes[:, :1]


def main(folder: Path) -> None:
    """Print by how much the readings of CMU's recordings are off, the root mean square over the
    recordings.
    """
    rng = np.random.default_rng(0)
    off = {}
    for name, nodes in recordings(folder):
        times = np.arange(len(nodes)) / 120 * SLOWER
        seen = np.einsum("ij,fnj->fni", VIEW, nodes) + rng.normal(0, 1, (*nodes.shape[:2], 2))
        cycle = cycle_of(seen, VIEW, times)
        moments = series(np.arange(PHASES) / PHASES)
        paths = np.einsum("ft,tjn->fnj", moments, lifted(seen, VIEW, times / cycle)[0])
        known = np.linalg.lstsq(series(times / cycle), nodes.reshape(len(nodes), -1), rcond=None)[0]
        known = (moments @ known).reshape(PHASES, -1, 3)
        print(
            name,
            f"cycle {cycle / SLOWER:.3f} s, nodes off by",
            f"{np.linalg.norm(paths - known, axis=2).mean():.3f} m",
        )
        for what, (value, _) in measured(paths).items():
            off.setdefault(what, []).append(value - measured(known)[what][0])
    for what, values in off.items():
        print(f"{what}: {np.sqrt(np.mean(np.square(values))):.3g}, mean {np.mean(values):.3g}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
