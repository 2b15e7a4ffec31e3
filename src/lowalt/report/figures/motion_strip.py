"""A strip of pictures a category: how one motion model's parts move over one cycle, seen in the target's own frame."""

import numpy as np
from matplotlib import pyplot as plt

from lowalt.motion import positions
from lowalt.recognition.distances import cycle_s, still_row
from lowalt.report.figures.style import png
from lowalt.targets.cloud import Cloud

DIRECTIONS = {"UAV": (0, 1, "from above"), "Bird": (0, 2, "from the front"), "Vehicle": (1, 2, "from the side"),
         "Pedestrian": (1, 2, "from the side")}  # fmt: skip


def view_of(cloud: Cloud) -> tuple[int, int, str]:
    """Return the two axes to show and their name: along the axes of rotors where these point to the front or aside."""
    rotors = [abs(cloud.axes[part]) for part in cloud.parts_of("rotor")]
    if rotors and all(axis[1] > 0.9 for axis in rotors):
        return 0, 2, "from behind"
    return DIRECTIONS[cloud.like]


def motion_strip(clouds: list[Cloud], rows: list[dict], instants: int = 7) -> bytes:
    """Draw the first motion model of each class at `instants` equal steps of its cycle; returns PNG bytes."""
    named = {cloud.subtype: cloud for cloud in clouds}
    chosen = [
        next(row for row in rows if row["category"] == name) for name in dict.fromkeys(row["category"] for row in rows)
    ]
    figure, panels = plt.subplots(len(chosen), instants, figsize=(1.7 * instants, 1.8 * len(chosen)), squeeze=False)
    for line, row in zip(panels, chosen, strict=True):
        cloud = named[row["subtype"]]
        across, up, view = view_of(cloud)
        times = np.arange(instants) / instants * cycle_s(cloud, row)
        points = positions(cloud, still_row(row), times)
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
    return png(figure)
