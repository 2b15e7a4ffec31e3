"""Command line of the echo stage: a chunk's motion table and clouds -> clean signals.

It writes one file per station.
"""

import sys

import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.config.network import Network
from lowalt.echo.chunk import clean_signals
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.motion import read_table
from lowalt.targets.cloud import read_clouds


def main(arguments: list[str]) -> None:
    """Compute one chunk's echoes and write one array file per station."""
    options = parser("lowalt.echo", __doc__)
    options.add_argument("--motion", required=True, help="the chunk's motion table")
    options.add_argument(
        "--clouds", nargs="+", required=True, help="cloud files of the chunk's subtypes"
    )
    options.add_argument(
        "--station", nargs="+", required=True, help="names of the stations that listen"
    )
    options.add_argument(
        "--out",
        nargs="+",
        required=True,
        help="clean signals to write (.npy), one per station: complex64 (models, N)",
    )
    given = options.parse_args(arguments)
    if len(given.out) != len(given.station):
        raise InputError(
            f"--out: {len(given.out)} files, expected one for each of the stations {given.station}"
        )
    block, tolerance = pick(given.settings, "network", "tolerance")
    network = Network.from_settings(block)
    clouds = read_clouds(given.clouds)
    result = clean_signals(network, given.station, clouds, read_table(given.motion), tolerance)
    for path, signals in zip(given.out, result, strict=True):
        with replacing(path, signals.nbytes) as temporary:
            np.save(temporary, signals)
        print(f"{path}: {len(signals)} signals", file=sys.stderr)


if __name__ == "__main__":
    run(main)
