"""The plan of a town with stations and the region of the targets, and the draft of an overlay.

The module also says in words what the town is.
"""

from pathlib import Path

import numpy as np
import yaml

from lowalt.config.network import Network
from lowalt.extensions.town.buildings import Buildings
from lowalt.files.atomic import replacing

AROUND_M = 100.0
"""Margin around stations and region within which buildings are drawn."""


def draw(path: Path, found: Buildings, network: Network, region: np.ndarray) -> None:
    """Write a picture of a town seen from above, with the stations and the targets' region.

    region: (C, 2) m.
    """
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot
    from matplotlib.collections import PolyCollection

    masts = np.array([station.position_m for station in network.stations])
    shown = np.concatenate([masts[:, :2], region])
    low = shown.min(axis=0) - AROUND_M
    high = shown.max(axis=0) + AROUND_M
    corners = found.corners[np.argsort(found.corners[..., 2].max(axis=1), kind="stable")]
    figure, axes = pyplot.subplots(figsize=(8, 7), layout="constrained")
    # Walls are lines from above, roofs are areas.
    faces = PolyCollection(
        list(corners[..., :2]),
        array=corners[..., 2].max(axis=1),
        cmap="viridis",
        edgecolors="face",
        linewidths=0.4,
    )
    axes.add_collection(faces)
    figure.colorbar(faces, label="height above ground (m)", shrink=0.8)
    closed = np.vstack([region, region[:1]])
    axes.plot(closed[:, 0], closed[:, 1], "k--", linewidth=1, label="region of the targets")
    for station in network.stations:
        if station.transmitter is None:
            x, y, z = station.position_m
            axes.plot(x, y, "r^", markersize=9)
            axes.annotate(f" {station.name}, {z:g} m", (x, y), color="red")
    axes.set(
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        xlabel="x, east (m)",
        ylabel="y, north (m)",
        aspect="equal",
    )
    axes.legend(loc="upper right")
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=110)
    pyplot.close(figure)


def described(path: Path, found: Buildings) -> list[str]:
    """Return in lines what a town is, what was left out and what was read otherwise than stated."""
    facts = found.facts
    low_x, low_y, _ = facts["low_m"]
    high_x, high_y, top = facts["high_m"]
    used = ", ".join(f"{name} ({count})" for name, count in facts["materials"].items())
    lines = [
        f"{path}: {facts['buildings']} buildings, {high_x - low_x:.0f} m x {high_y - low_y:.0f} m, "
        f"up to {top:.1f} m high",
        f"x from {low_x:.1f} to {high_x:.1f} m, y from {low_y:.1f} to {high_y:.1f} m",
        f"{facts['walls']} walls and {facts['roofs']} roofs, merged from {facts['triangles']} "
        "triangles",
        f"materials (triangles): {used}; ground: {facts['ground']}",
    ]
    lines += [f"left out: {count} {reason}" for reason, count in facts["dropped"].items()]
    return lines + [f"read otherwise: {count} {reason}" for reason, count in facts["notes"].items()]


def overlay(settings: dict, name: str, comments: list[str]) -> str:
    """Return the overlay of a scene in a town, with comments before it.

    settings: those of the effect `town` that are not the default's.
    """
    scene = {"run": name, "effects": {"town": settings}}
    head = "".join(f"# {line}\n" for line in comments)
    return head + yaml.safe_dump(scene, sort_keys=False, allow_unicode=True)
