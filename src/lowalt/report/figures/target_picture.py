"""Pictures of one target: its points with hinges and axes, its motion over a cycle, its spectra."""

import numpy as np
from matplotlib import pyplot as plt

from lowalt.config.layers import load_yaml
from lowalt.config.network import Network, masts_m
from lowalt.echo import Rigid, echo_signal
from lowalt.files.shipped import SHIPPED
from lowalt.motion import poses, positions
from lowalt.motion.drawing import draw, region_polygon
from lowalt.numerics.streams import stream
from lowalt.recognition.distances import cycle_s, still_row
from lowalt.report.figures.style import png
from lowalt.report.figures.tile_axes import times_s
from lowalt.spectra import Spectra, spectrum
from lowalt.spectra.interface import OfCells
from lowalt.targets.cloud import Cloud
from lowalt.targets.gallery import bones

DIRECTIONS = (("from above", 0, 1), ("from the right", 1, 2), ("from behind", 0, 2))
AXES = ("right x (m)", "front y (m)", "up z (m)")
FRONT = 1
"""Number of the axis that points to the front."""
NORMALS = 150
"""Normals drawn at most: more would hide the points."""
STEPS = 48
"""Steps of a cycle at which the paths of tips are drawn; a multiple of eight."""
GREY = (0.55, 0.55, 0.58, 1.0)
"""Colour of the body, RGBA."""
FLOOR_DB = -40.0
CONFIG = SHIPPED / "config/default.yaml"
SEED = 1
"""Of the motion model that is shown."""


def _colours(cloud: Cloud) -> np.ndarray:
    """RGBA colour of each point (L, 4), by its part."""
    table = plt.get_cmap("tab20")
    colours = []
    for number, kind in enumerate(cloud.kinds):
        colours.append(GREY if kind == "body" else table(number % 20))
    return np.array(colours)[cloud.part]


def _limits(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Middle (3,) and half width of a cube with a margin around all points (..., 3)."""
    flat = points.reshape(-1, 3)
    return (flat.min(axis=0) + flat.max(axis=0)) / 2, 0.58 * float(np.ptp(flat, axis=0).max())


def draw_view(
    panel,
    cloud: Cloud,
    points: np.ndarray,
    view: tuple[str, int, int],
    middle: np.ndarray,
    half: float,
) -> None:
    """Draw points (L, 3) m and the bones between them as seen along one axis.

    view: one of DIRECTIONS; middle, half: centre (3,) m of the square that is shown, and half its
    width (m).
    """
    title, across, up = view
    panel.scatter(points[:, across], points[:, up], s=6, c=_colours(cloud), linewidths=0)
    for bone in bones(cloud.names):
        x, y = points[list(bone)][:, [across, up]].T
        panel.plot(x, y, color="0.6", linewidth=0.8, zorder=0)
    panel.set(
        xlim=middle[across] + np.array([-half, half]),
        ylim=middle[up] + np.array([-half, half]),
        aspect="equal",
    )
    panel.set(title=title, xlabel=AXES[across], ylabel=AXES[up])
    panel.grid(alpha=0.25)


def _marks(
    panel, cloud: Cloud, view: tuple[str, int, int], middle: np.ndarray, half: float
) -> None:
    """Hinges with their axes, some normals, and an arrow to the front where the view shows it."""
    _, across, up = view
    some = np.flatnonzero(np.isfinite(cloud.normals).all(axis=1))
    if len(some):
        evenly = np.linspace(0, len(some) - 1, min(NORMALS, len(some)))
        some = some[evenly.round().astype(int)]
    tips = cloud.points[some] + 0.05 * half * cloud.normals[some]
    ends = np.stack([cloud.points[some], tips])
    panel.plot(ends[..., across], ends[..., up], color="0.75", linewidth=0.5, zorder=0)
    for hinge, axis in zip(cloud.hinges, cloud.axes, strict=True):
        if np.isfinite(hinge).all():
            ends = np.stack([hinge - 0.12 * half * axis, hinge + 0.12 * half * axis])
            panel.plot(ends[:, across], ends[:, up], color="black", linewidth=0.9)
            panel.plot(hinge[across], hinge[up], "k.", markersize=4)
    centre = np.array([middle[across], middle[up]])
    arrow = None
    if up == FRONT:
        # The arrow points up, beside the left edge.
        arrow = np.array([0, 0.8 * half])
        start = centre - np.array([0.9 * half, 0]) - arrow / 2
    elif across == FRONT:
        # The arrow points right, above the lower edge.
        arrow = np.array([0.8 * half, 0])
        start = centre - np.array([0.4 * half, 0.92 * half])
    if arrow is not None:
        panel.annotate(
            "front",
            xy=start + arrow,
            xytext=start,
            color="tab:red",
            fontsize=8,
            ha="center",
            va="center",
            arrowprops={"arrowstyle": "->", "color": "tab:red"},
        )


def _motion_row(cloud: Cloud, config: dict) -> dict:
    """One motion model of the target, drawn as the motion stage draws them."""
    masts = np.array(masts_m(config["network"]))
    corners = region_polygon(masts, config["motion"]["region"]["polygon_m"])
    row = draw(
        stream(SEED, "show", cloud.subtype),
        cloud,
        cloud.record["published"],
        masts,
        corners,
        config["motion"],
    )
    return {**row, "group": cloud.record.get("group", "seen"), "model": 0}


def _decibel(values: np.ndarray) -> np.ndarray:
    """Magnitudes relative to their largest, in dB, at least FLOOR_DB."""
    top = float(values.max())
    if top == 0:
        return np.full(values.shape, FLOOR_DB)
    return 20 * np.log10(np.maximum(values, top * 10 ** (FLOOR_DB / 20)) / top)


def _spectra(panels, cloud: Cloud, row: dict, config: dict) -> None:
    """Up to three spectra of the first station, axes in seconds and metres a second."""
    network = Network.from_settings(config["network"])
    station = network.stations[0]
    settings = Spectra.from_settings(config["spectra"])
    motion = Rigid(*poses(cloud, row, network.times_s), cloud.points, cloud.part)
    aim = np.array([row["x_m"], row["y_m"], row["z_m"]])
    signal = echo_signal(network, station, motion, cloud.rcs_m2, aim).signal
    of_station = (station.frequency_hz, network.symbol_interval_s)
    for panel, (name, windows) in zip(panels, settings.items(), strict=False):
        kind = spectrum(name)
        if isinstance(kind, OfCells):
            continue
        values = kind.definition(signal, windows, name, *of_station)
        if kind.SIGNED:
            label = "signed power"
            top = float(abs(values).max()) or 1.0
            scale = {"vmin": -top, "vmax": top, "cmap": "RdBu_r"}
        else:
            label = "dB"
            values = _decibel(values)
            scale = {"vmin": FLOOR_DB, "vmax": 0.0, "cmap": "viridis"}
        extent = *times_s(windows, network), *kind.speeds(windows, network, station)
        picture = panel.imshow(
            values, origin="lower", aspect="auto", extent=extent, interpolation="nearest", **scale
        )
        panel.set(
            title=kind.TITLE,
            xlabel="time (s)",
            ylabel="radial speed (m/s)\nreceding upwards, folded",
        )
        panel.set_ylim(sorted(extent[2:]))
        panel.figure.colorbar(picture, ax=panel, label=label, fraction=0.05)


def most_moved(cloud: Cloud, frames: np.ndarray) -> np.ndarray:
    """Return the numbers of the points whose paths are drawn.

    frames: (T, L, 3) m. They are the point of each moving part that travels farthest, or the four
    nodes of a recording that do; none where nothing moves.
    """
    travelled = np.linalg.norm(np.diff(frames, axis=0), axis=2).sum(axis=0)
    if len(cloud.track):
        return np.argsort(-travelled, kind="stable")[:4]
    parts = [
        np.flatnonzero(cloud.part == part)
        for part, kind in enumerate(cloud.kinds)
        if kind != "body"
    ]
    return np.array([part[travelled[part].argmax()] for part in parts if len(part)], int)


def _instants(panels, cloud: Cloud, row: dict) -> None:
    """The target at four instants of a cycle, with the paths of the tips of its moving parts.

    A part that turns is seen along its axis, wings from behind, and a recording from the right.
    """
    length = cycle_s(cloud, row)
    frames = positions(cloud, still_row(row), np.linspace(0, length, STEPS + 1))
    tips = most_moved(cloud, frames)
    along = np.array([1.0, 0, 0])
    if not len(cloud.track):  # the axes of larger parts count more
        sizes = [
            np.ptp(cloud.points[cloud.part == part], axis=0).max()
            for part in range(len(cloud.kinds))
        ]
        along = np.array(sizes) @ np.abs(np.nan_to_num(cloud.axes))
    view = {2: DIRECTIONS[0], 0: DIRECTIONS[1], 1: DIRECTIONS[2]}[int(along.argmax())]
    _, across, up = view
    middle, half = _limits(frames)
    steps = (np.arange(len(panels)) * STEPS) // len(panels)
    if "rotor" in cloud.kinds or "wheel" in cloud.kinds:
        # Two blades look the same after half a turn, so an eighth of the cycle is added in each
        # panel.
        steps = steps // 2
    for panel, step in zip(panels, steps.tolist(), strict=True):
        draw_view(panel, cloud, frames[step], view, middle, half)
        panel.plot(frames[:, tips, across], frames[:, tips, up], color="tab:red", linewidth=0.7)
        panel.plot(
            frames[step, tips, across], frames[step, tips, up], "o", color="tab:red", markersize=4
        )
        panel.set(title=f"{view[0]}, {1000 * step / STEPS * length:.4g} of {1000 * length:.4g} ms")


def target_picture(cloud: Cloud) -> bytes:
    """Return a PNG of a cloud: three views, the target at four instants, and spectra.

    Views are in metres with hinges, axes and normals; the instants are of a cycle, with the paths
    of tips; the spectra are of one motion model.

    The motion model is drawn as the workflow draws them, for the network of the configuration.
    Raises: InputError where there is no such configuration, or the target's motion cannot be drawn.
    """
    config = load_yaml(CONFIG)
    row = _motion_row(cloud, config)
    figure = plt.figure(figsize=(14, 13), layout="constrained")
    top, middle_row, bottom = figure.subfigures(3, 1, squeeze=False)[:, 0]
    views = top.subplots(1, 3)
    instants = middle_row.subplots(1, 4)
    spectra = bottom.subplots(1, 3)
    points = cloud.track[0] if len(cloud.track) else cloud.points
    middle, half = _limits(points)
    for panel, view in zip(views, DIRECTIONS, strict=True):
        draw_view(panel, cloud, points, view, middle, half)
        _marks(panel, cloud, view, middle, half)
    _instants(instants, cloud, row)
    _spectra(spectra, cloud, row, config)
    size = " x ".join(f"{value:.3g}" for value in np.ptp(points, axis=0))
    doubts = "".join(f"\nwarning: {text}" for text in cloud.record.get("warnings", []))
    about = f"{cloud.subtype} ({cloud.category}, {cloud.record['source']})"
    figure.suptitle(
        f"{about}: {len(points)} points, {len(cloud.kinds)} parts, {size} m{doubts}", fontsize=11
    )
    return png(figure)
