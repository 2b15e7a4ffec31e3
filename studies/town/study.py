"""An invented town of blocks, and a picture of a drone in it: its paths and its micro-Doppler."""

import argparse
import json
from pathlib import Path

import numpy as np

from lowalt.config.layers import overlaid
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.extensions.town import image_paths
from lowalt.extensions.town.buildings import read
from lowalt.extensions.town.footprints import moved
from lowalt.extensions.town.town import DEFAULTS
from lowalt.files.atomic import replacing
from lowalt.scene import explanation
from lowalt.scene.chain import received_signal

HERE = Path(__file__).parent
ORIGIN = (11.575, 48.137)
"""Longitude and latitude of x = y = 0; the town itself is nowhere."""
STREET_M, BLOCK_M = 60.0, 36.0
"""Distance between the middles of neighbouring blocks, and their side."""
KEPT_CLEAR_M = 30.0
"""No block stands nearer to a station."""
SUBTYPE, PLACE_M = "DJI Mini 2", (122.0, 190.0, 12.0)
"""The drone of the picture and where it flies: in a street, below the roofs."""


def blocks(masts: np.ndarray, across_m: np.ndarray, along_m: np.ndarray) -> dict:
    """Return a town as GeoJSON: square blocks around the places of a grid of streets (m), 8 to 22 m high."""
    rng, features = np.random.default_rng(63), []
    for x in across_m:
        for y in along_m:
            height = int(rng.integers(8, 23))
            if np.hypot(*(masts - [x, y]).T).min() < KEPT_CLEAR_M:
                continue
            around = [(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]
            ring = [moved(ORIGIN, (x + a * BLOCK_M / 2, y + b * BLOCK_M / 2)) for a, b in around]
            features.append({
                "type": "Feature", "properties": {"building": "yes", "height": height},
                "geometry": {"type": "Polygon", "coordinates": [ring]},
            })  # fmt: skip
    return {"type": "FeatureCollection", "features": features}


def corners_of(facets, route: image_paths.Route, mast: np.ndarray) -> np.ndarray:
    """Return the corners (K, 3) m of a path to the only point of a route, from the mast on."""
    points, image = [mast], route.images[0, 0]
    for k in route.facets:
        normal, offset = facets.normal[k], facets.offset[k]
        here, there = normal @ points[-1] - offset, normal @ image - offset
        points.append(points[-1] + here / (here - there) * (image - points[-1]))
        image = image - 2.0 * there * normal
    return np.array([*points, image])


def spectrograms(figure, axes: dict, signals: dict[str, np.ndarray], rate_hz: float, carrier_hz: float) -> None:
    """Draw the spectrograms of the signals (symbols,) "free" and "town" into their axes, in dB over the peak of the
    first."""
    from scipy.signal import stft

    top = None
    for name, title in (("free", "without buildings"), ("town", "in the town")):
        hz, at, power = stft(signals[name], rate_hz, nperseg=64, noverlap=60, return_onesided=False)
        power = 20 * np.log10(np.fft.fftshift(abs(power), axes=0) + 1e-30)
        top = power.max() if top is None else top
        speed = np.fft.fftshift(hz) * SPEED_OF_LIGHT / (2 * carrier_hz)
        mesh = axes[name].pcolormesh(at, speed, power - top, cmap="viridis", vmin=-70, vmax=0, shading="nearest")
        axes[name].set(title=title, xlabel="time (s)", ylabel="radial speed (m/s)")
    figure.colorbar(mesh, ax=[axes["free"], axes["town"]], label="power over the free peak (dB)")


def draw(config: dict, out: Path) -> None:
    """Write the picture: the plan with all paths from the first station, and two spectrograms."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot
    from matplotlib.collections import PolyCollection

    (sample,) = explanation.samples(config, None, [(SUBTYPE, 0)])
    x, y, z = PLACE_M
    sample = sample._replace(
        row=sample.row | {"x_m": x, "y_m": y, "z_m": z, "vx_mps": 0.5, "vy_mps": 1.5, "vz_mps": 0.0}
    )
    scene = explanation.scene_of(config)
    station = scene.network.stations[0]
    found = read(DEFAULTS | config["effects"]["town"])
    mast, place = np.array(station.position_m, float), np.array([[PLACE_M]])
    frequency = radar(scene.network, station).centre_hz
    rays, epsilon = image_paths.rays_to(place, 0.0), image_paths.epsilons(found.town, frequency, "town")
    lit, field = image_paths.direct(found.town, mast, place, rays, SPEED_OF_LIGHT / frequency, True)
    routes = image_paths.reflected(found.town, epsilon, mast, place, rays, 2)
    figure, axes = pyplot.subplot_mosaic([["plan", "free"], ["plan", "town"]], figsize=(11, 5.6), layout="constrained",
                                         width_ratios=[1.25, 1])  # fmt: skip
    plan = axes["plan"]
    order = np.argsort(found.corners[..., 2].max(axis=1), kind="stable")
    faces = PolyCollection(found.corners[order][..., :2], array=found.corners[order][..., 2].max(axis=1), cmap="Greys",
                           edgecolors="face", clim=(0, 40))  # fmt: skip
    plan.add_collection(faces)
    direct_db = 20 * np.log10(abs(field[0, 0]))
    seen, style = ("free", "k-") if lit[0, 0] else ("past edges", "k:")
    plan.plot(*np.array([mast, PLACE_M])[:, :2].T, style, label=f"direct, {seen}, {direct_db:.0f} dB")
    bends = [np.array([mast, PLACE_M])]
    for number, route in enumerate(routes):
        path = corners_of(found.town.facets, route, mast)
        bends.append(path)
        loss = 20 * np.log10(abs(route.coefficient[0, 0]) * np.linalg.norm(mast - PLACE_M)
                             / np.linalg.norm(route.images[0, 0] - mast))  # fmt: skip
        names = " and ".join("ground" if k == len(found.town.facets.offset) - 1 else "wall" for k in route.facets)
        # Paths over each other in the plan are dashes of different colours.
        plan.plot(*path[:, :2].T, color=f"C{number}", linestyle=(4 * number, (4, 4 * (len(routes) - 1))), linewidth=1.8)
        plan.plot([], color=f"C{number}", linewidth=1.8, label=f"{names}, {loss:.0f} dB")
    plan.plot(*mast[:2], "r^", markersize=9)
    plan.plot(x, y, "bo", markersize=6)
    plan.annotate(f" {SUBTYPE}, {z:g} m", (x, y), color="blue")
    plan.annotate(f" station {station.name}, {mast[2]:g} m", mast[:2], color="red", ha="left", va="top")
    shown = np.concatenate(bends)[:, :2]
    low, high = shown.min(axis=0) - (80.0, 50.0), shown.max(axis=0) + np.array([120.0, 50.0])
    plan.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x (m)", ylabel="y (m)", aspect="equal")
    plan.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, fontsize=8)
    clouds = {sample.cloud.subtype: sample.cloud}
    without = {name: block for name, block in config["effects"].items() if name != "town"}
    signals = {"free": received_signal(explanation.scene_of(config | {"effects": without}), station, *sample, clouds),
               "town": received_signal(scene, station, *sample, clouds)}  # fmt: skip
    spectrograms(figure, axes, {name: one.signal for name, one in signals.items()},
                 1.0 / scene.network.symbol_interval_s, frequency)  # fmt: skip
    with replacing(out) as temporary:
        figure.savefig(temporary, dpi=110)


def write_blocks(path: Path, across_m: np.ndarray, along_m: np.ndarray) -> None:
    """Write the town of blocks around the stations of the default configuration as GeoJSON."""
    masts = np.array([station["position_m"][:2] for station in overlaid([])["network"]["stations"].values()])
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(blocks(masts, across_m, along_m), separators=(",", ":")) + "\n")


def main() -> None:
    """Write the town, or the picture."""
    line = argparse.ArgumentParser(description=__doc__)
    line.add_argument("--town", type=Path, help="GeoJSON to write")
    line.add_argument("--figure", type=Path, help="picture to write")
    options = line.parse_args()
    if options.town:
        write_blocks(options.town, np.arange(-20.0, 530.0, STREET_M), np.arange(-20.0, 480.0, STREET_M))
    if options.figure:
        draw(overlaid([HERE / "config.yaml"]), options.figure)


if __name__ == "__main__":
    main()
