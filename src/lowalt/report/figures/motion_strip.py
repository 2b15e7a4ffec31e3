"""A strip of pictures a category: how one motion model's parts move over one cycle, seen in the target's own frame."""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from lowalt.motion import positions
from lowalt.recognition.distances import cycle_s, still_row
from lowalt.targets.cloud import Cloud

DIRECTIONS = {"UAV": (0, 1, "from above"), "Bird": (0, 2, "from the front"), "Vehicle": (1, 2, "from the side"),
         "Pedestrian": (1, 2, "from the side")}  # fmt: skip


def view_of(cloud: Cloud) -> tuple[int, int, str]:
    """Return the two axes to show and their name: along the axes of rotors where these point to the front or aside."""
    rotors = [abs(cloud.axes[part]) for part in cloud.parts_of("rotor")]
    if rotors and all(axis[1] > 0.9 for axis in rotors):
        return 0, 2, "from behind"
    return DIRECTIONS[cloud.like]


def _chosen(rows: list[dict]) -> list[dict]:
    """The first motion model of each class."""
    return [
        next(row for row in rows if row["category"] == name) for name in dict.fromkeys(row["category"] for row in rows)
    ]


def _frames(cloud: Cloud, row: dict, instants: int) -> tuple[np.ndarray, np.ndarray]:
    """Instants (s) of one cycle, and the points at them, (instants, points, 3) m in the target's own frame."""
    times = np.arange(instants) / instants * cycle_s(cloud, row)
    return times, positions(cloud, still_row(row), times)


def strip_rows(clouds: list[Cloud], rows: list[dict], instants: int = 7) -> list[dict]:
    """Return the points that `strip_figure` draws: subtype, time (ms), part, x, y, z (m, to 0.1 mm)."""
    named, points = {cloud.subtype: cloud for cloud in clouds}, []
    for row in _chosen(rows):
        cloud = named[row["subtype"]]
        for time, frame in zip(*_frames(cloud, row, instants), strict=True):
            for part, point in zip(cloud.part.tolist(), np.round(frame, 4).tolist(), strict=True):
                facts = {"subtype": cloud.subtype, "time_ms": float(f"{1000 * time:.6g}"), "part": part}
                points.append(facts | dict(zip(("x_m", "y_m", "z_m"), point, strict=True)))
    return points


def strip_figure(clouds: list[Cloud], rows: list[dict], instants: int = 7) -> Figure:
    """Draw the first motion model of each class at `instants` equal steps of its cycle."""
    named, chosen = {cloud.subtype: cloud for cloud in clouds}, _chosen(rows)
    figure, panels = plt.subplots(len(chosen), instants, figsize=(1.7 * instants, 1.8 * len(chosen)), squeeze=False)
    for line, row in zip(panels, chosen, strict=True):
        cloud = named[row["subtype"]]
        across, up, view = view_of(cloud)
        times, points = _frames(cloud, row, instants)
        low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
        half = 0.55 * max(high[across] - low[across], high[up] - low[up])
        middle = (low + high) / 2
        moving = np.array([kind != "body" for kind in cloud.kinds])[cloud.part]
        for panel, time, frame in zip(line, times, points, strict=True):
            panel.scatter(frame[~moving, across], frame[~moving, up], s=2, color="0.6")
            panel.scatter(frame[moving, across], frame[moving, up], s=3, c=cloud.part[moving], cmap="tab10")
            panel.set(xlim=(middle[across] - half, middle[across] + half), ylim=(middle[up] - half, middle[up] + half))
            panel.set(aspect="equal", xticks=[], yticks=[])
            panel.set_title(f"{1000 * time:.4g} ms", fontsize=8)
        line[0].set_ylabel(f"{row['subtype']}\n{view}", fontsize=8)
    figure.tight_layout()
    return figure
