"""The plan of a town with stations and the region of the targets, what it is in words, and the draft of an overlay."""

from pathlib import Path

import numpy as np
import yaml

from lowalt.config.network import Network
from lowalt.extensions.town.buildings import Buildings
from lowalt.files.atomic import replacing

AROUND_M = 100.0
"""Margin around stations and region within which buildings are drawn."""


def draw(path: Path, found: Buildings, network: Network, region: np.ndarray) -> None:
    """Write a picture of a town seen from above, with the stations and the region (C, 2) m of the targets."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot
    from matplotlib.collections import PolyCollection

    masts = np.array([station.position_m for station in network.stations])
    shown = np.concatenate([masts[:, :2], region])
    low, high = shown.min(axis=0) - AROUND_M, shown.max(axis=0) + AROUND_M
    corners = found.corners[np.argsort(found.corners[..., 2].max(axis=1), kind="stable")]
    figure, axes = pyplot.subplots(figsize=(8, 7), layout="constrained")
    # Walls are lines from above, roofs are areas.
    faces = PolyCollection(corners[..., :2], array=corners[..., 2].max(axis=1), cmap="viridis", edgecolors="face",
                           linewidths=0.4)  # fmt: skip
    axes.add_collection(faces)
    figure.colorbar(faces, label="height above ground (m)", shrink=0.8)
    axes.plot(*np.vstack([region, region[:1]]).T, "k--", linewidth=1, label="region of the targets")
    for station in network.stations:
        if station.transmitter is None:
            axes.plot(*station.position_m[:2], "r^", markersize=9)
            axes.annotate(f" {station.name}, {station.position_m[2]:g} m", station.position_m[:2], color="red")
    axes.set(
        xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x, east (m)", ylabel="y, north (m)", aspect="equal"
    )
    axes.legend(loc="upper right")
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=110)
    pyplot.close(figure)


def described(path: Path, found: Buildings) -> list[str]:
    """Return what a town is, what was left out and what was read otherwise than stated, in lines."""
    facts, low, high = found.facts, np.array(found.facts["low_m"]), np.array(found.facts["high_m"])
    used = ", ".join(f"{name} ({count})" for name, count in facts["materials"].items())
    lines = [
        f"{path}: {facts['buildings']} buildings, {high[0] - low[0]:.0f} m x {high[1] - low[1]:.0f} m, up to "
        f"{high[2]:.1f} m high",
        f"x from {low[0]:.1f} to {high[0]:.1f} m, y from {low[1]:.1f} to {high[1]:.1f} m",
        f"{facts['walls']} walls and {facts['roofs']} roofs, merged from {facts['triangles']} triangles",
        f"materials (triangles): {used}; ground: {facts['ground']}",
    ]
    lines += [f"left out: {count} {reason}" for reason, count in facts["dropped"].items()]
    return lines + [f"read otherwise: {count} {reason}" for reason, count in facts["notes"].items()]


def overlay(settings: dict, name: str, comments: list[str]) -> str:
    """Return the overlay of a scene in a town, with comments before it; settings: those that are not default."""
    block = yaml.safe_dump({"run": name, "effects": {"town": settings}}, sort_keys=False, allow_unicode=True)
    return "".join(f"# {line}\n" for line in comments) + block
