"""Command line of the echo stage: a chunk's motion table and clouds -> clean signals, one file a station."""

import sys

import numpy as np

from lowalt.common.command import parser, pick, run
from lowalt.common.errors import InputError
from lowalt.common.files import replacing
from lowalt.common.network import Network
from lowalt.common.progress import reported
from lowalt.echo.api import echo_signal, explain
from lowalt.echo.scene import Rigid, target
from lowalt.motion import poses, read_table
from lowalt.targets.cloud import Cloud, cloud_of, read


def signals(
    network: Network,
    names: list[str],
    clouds: dict[str, Cloud],
    rows: list[dict],
    tolerance: float | None,
    notes: list[str] | None = None,
) -> np.ndarray:
    """Return clean signals (stations, models, N) complex64 of the motion table `rows` at the stations `names`.

    The beams aim at each cloud's origin at the first symbol. `notes` gets a text a signal: how it was computed.
    Raises: InputError naming the sample where a subtype has no cloud or a position cannot be computed with.
    """
    stations, times_s = [network.station(name) for name in names], network.times_s
    result = np.empty((len(stations), len(rows), network.symbols), np.complex64)
    for index, row in enumerate(reported(rows, len(rows), "models")):
        sample = f"{row['subtype']}, model {row['model']}"
        cloud = cloud_of(clouds, row)
        seen = target(Rigid(*poses(cloud, row, times_s), cloud.points, cloud.part), cloud.rcs_m2, sample)
        aim = np.array([row["x_m"], row["y_m"], row["z_m"]])
        for place, station in enumerate(stations):
            where = f"{sample}, station {station.name}"
            found = echo_signal(network, station, seen, None, aim, tolerance, sample=where)
            result[place, index] = found.signal
            if notes is not None:
                notes.append(f"{where}\n{explain(found)}\n")
    return result


def main(arguments: list[str]) -> None:
    """Compute one chunk's echoes and write one array file a station."""
    options = parser("lowalt.echo", __doc__)
    options.add_argument("--motion", required=True, help="the chunk's motion table")
    options.add_argument("--clouds", nargs="+", required=True, help="cloud files of the chunk's subtypes")
    options.add_argument("--station", nargs="+", required=True, help="names of the stations that listen")
    options.add_argument(
        "--out", nargs="+", required=True, help="clean signals to write (.npy), a file a station: complex64 (models, N)"
    )
    options.add_argument("--explain", help="text to write: how each signal was computed, and by which bounds")
    given = options.parse_args(arguments)
    if len(given.out) != len(given.station):
        raise InputError(f"--out: {len(given.out)} files, expected one for each of the stations {given.station}")
    block, tolerance = pick(given.settings, "network", "tolerance")
    network = Network.from_settings(block)
    clouds = {cloud.subtype: cloud for cloud in map(read, given.clouds)}
    notes: list[str] | None = [] if given.explain else None
    result = signals(network, given.station, clouds, read_table(given.motion), tolerance, notes)
    if given.explain:
        with replacing(given.explain) as temporary:
            temporary.write_text("\n".join(notes))
    for path, found in zip(given.out, result, strict=True):
        with replacing(path, found.nbytes) as temporary:
            np.save(temporary, found)
        print(f"{path}: {len(found)} signals", file=sys.stderr)


if __name__ == "__main__":
    run(main)
