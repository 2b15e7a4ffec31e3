"""Diffraction at one edge of a wide screen: the effect `town`, Sionna RT and the approximation of ITU-R P.526.

One row for each edge, distance and place behind it: the field over that in free space, in dB. `bend_deg` is the angle
by which a ray past the edge bends. The ray tracer's diffraction is that of a half plane by the uniform theory of
diffraction, ours is Kirchhoff's integral.
"""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from match import CARRIER_HZ, SLAB_M, ray_tracer

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.town import image_paths
from lowalt.extensions.town.buildings import read
from lowalt.extensions.town.town import DEFAULTS
from lowalt.files.csv_tables import write_csv

WIDE_M, TALL_M, EDGE_M, UNDER_M = 2000.0, 800.0, 30.0, 5.0
"""Half the screen's width; its height where its side is the near edge; the top edge's height, at which waves pass the
side, too; and the station's depth below the top or behind the side."""
AWAY_M = ((100.0, 100.0), (200.0, 30.0))
"""Distances of the station and of the places from the screen."""
OFF_M = (-30.0, -20.0, -15.0, -10.0, -5.0, -2.0, 0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 15.0, 20.0)
"""Places beyond the edge: those below zero are behind the screen."""
COLUMNS = ("edge", "station_m", "place_m", "beyond_m", "bend_deg", "nu", "lowalt_db", "sionna_db", "p526_db")
SCENE = """<scene version="2.1.0">
<bsdf type="itu-radio-material" id="mat-metal"><string name="type" value="metal"/></bsdf>
<shape type="ply" id="screen"><string name="filename" value="screen.ply"/><ref id="mat-metal"/></shape>
</scene>
"""


def point(edge: str, x: float, beyond: float) -> np.ndarray:
    """Return the place (3,) m at x that is `beyond` the edge (m), "top" or "side"."""
    return np.array([x, 0.0, EDGE_M + beyond] if edge == "top" else [x, -beyond, EDGE_M])


def write_screen(path: Path, edge: str, bottom_m: float) -> None:
    """Write the screen in the plane x = 0 as a PLY: its only near edge is the top or the side at y = 0."""
    right, top = (-WIDE_M, EDGE_M) if edge == "top" else (0.0, TALL_M)
    corners = [(0, right, bottom_m), (0, WIDE_M, bottom_m), (0, WIDE_M, top), (0, right, top)]
    head = ["ply", "format ascii 1.0", "element vertex 4", *(f"property float {axis}" for axis in "xyz"),
            "element face 2", "property list uchar int vertex_indices", "end_header"]  # fmt: skip
    lines = [*head, *(" ".join(map(str, corner)) for corner in corners), "3 0 1 2", "3 0 2 3", ""]
    path.write_text("\n".join(lines))


def of_lowalt(path: Path, mast: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the direct field at places (K, 3) m over that in free space, (K,) complex."""
    town, wavelength = read(DEFAULTS | {"buildings": str(path), "material": "metal"}).town, SPEED_OF_LIGHT / CARRIER_HZ
    fields = []
    for place in places:
        ends = place[None, None]
        fields.append(image_paths.direct(town, mast, ends, image_paths.rays_to(ends, 0.0), wavelength, True)[1][0, 0])
    return np.array(fields)


def of_sionna(rt, folder: Path, mast: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the same of the ray tracer."""
    (folder / "scene.xml").write_text(SCENE)
    scene = rt.load_scene(str(folder / "scene.xml"))
    scene.frequency = CARRIER_HZ
    scene.tx_array = scene.rx_array = rt.PlanarArray(num_rows=1, num_cols=1, pattern="iso", polarization="V")
    for material in scene.radio_materials.values():
        material.thickness = SLAB_M
    scene.add(rt.Transmitter("mast", mast.tolist()))
    for k, place in enumerate(places):
        scene.add(rt.Receiver(f"place{k:03d}", place.tolist()))
    paths = rt.PathSolver()(
        scene, max_depth=1, los=True, specular_reflection=False, refraction=False, diffraction=True,
        edge_diffraction=True,
    )  # fmt: skip
    gains, _ = paths.cir(normalize_delays=False, out_type="numpy")
    length = np.linalg.norm(places - mast, axis=1)
    free = SPEED_OF_LIGHT / CARRIER_HZ / (4 * np.pi * length)
    return gains[:, 0, 0, 0, :, 0].sum(axis=1) / free


def p526_db(nu: float) -> float:
    """Return the field behind a knife edge (dB), 0 below the range of the formula. Source: ITU-R P.526-15, eq. 31."""
    return -(6.9 + 20 * np.log10(np.hypot(nu - 0.1, 1.0) + nu - 0.1)) if nu > -0.78 else 0.0


def nu_of(station_m: float, place_m: float, beyond: float) -> float:
    """Return the parameter nu of the edge for a ray that ends `beyond` it (m). Source: ITU-R P.526-15, eq. 26."""
    share, length = station_m / (station_m + place_m), float(np.hypot(station_m + place_m, beyond + UNDER_M))
    off = (UNDER_M - share * (beyond + UNDER_M)) * (station_m + place_m) / length
    return off * float(np.sqrt(2 * CARRIER_HZ / (SPEED_OF_LIGHT * length * share * (1 - share))))


def main(arguments: list[str]) -> None:
    """Compare both and write the table."""
    line = argparse.ArgumentParser(description=__doc__)
    line.add_argument("--llvm", help="path of libLLVM.so of version 19")
    line.add_argument("--out", type=Path, required=True)
    options = line.parse_args(arguments)
    rt, rows = ray_tracer(options.llvm), []
    with TemporaryDirectory() as name:
        for edge in ("top", "side"):
            ours, theirs = Path(name) / "lowalt.ply", Path(name) / "screen.ply"
            # Under the ray tracer's screen no wave passes within reach; a town stands on the ground.
            write_screen(ours, edge, 0.0)
            write_screen(theirs, edge, -WIDE_M)
            for station_m, place_m in AWAY_M:
                mast = point(edge, -station_m, -UNDER_M)
                places = np.array([point(edge, place_m, beyond) for beyond in OFF_M])
                fields = of_lowalt(ours, mast, places), of_sionna(rt, theirs.parent, mast, places)
                for beyond, *both in zip(OFF_M, *fields, strict=True):
                    nu = nu_of(station_m, place_m, beyond)
                    bend_deg = np.degrees(np.arctan(UNDER_M / station_m) - np.arctan(beyond / place_m))
                    values = (bend_deg, nu, *(20 * np.log10(abs(value)) for value in both), p526_db(nu))
                    rows.append((edge, station_m, place_m, beyond, *(f"{value:.2f}" for value in values)))
    write_csv(options.out, COLUMNS, rows)


if __name__ == "__main__":
    main(sys.argv[1:])
