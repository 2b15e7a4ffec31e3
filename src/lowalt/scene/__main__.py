"""Command line of the echo stage in a scene with effects: motion table and clouds -> signals.

It also writes the reference powers.
"""

import sys

import numpy as np

from lowalt.config.command import parser, pick, run
from lowalt.config.network import Network
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.motion import read_table
from lowalt.scene.chain import scene_signals
from lowalt.scene.effects import called
from lowalt.scene.observe import Scene
from lowalt.targets.cloud import read_clouds


def main(arguments: list[str]) -> None:
    """Compute one chunk's signals under the scene's effects; write two array files per station."""
    options = parser("lowalt.scene", __doc__)
    options.add_argument("--motion", required=True, help="the chunk's motion table")
    options.add_argument(
        "--clouds", nargs="+", required=True, help="cloud files of the chunk's subtypes"
    )
    options.add_argument(
        "--occluders", nargs="*", default=[], help="surface files of the chunk's subtypes"
    )
    options.add_argument(
        "--station", nargs="+", required=True, help="names of the stations that listen"
    )
    options.add_argument(
        "--out",
        nargs="+",
        required=True,
        help="signals to write (.npy), one file per station: complex64 (models, N), or (models, "
        "snrs, N)",
    )
    options.add_argument(
        "--power",
        nargs="+",
        required=True,
        help="the echoes' own mean powers to write (.npy), likewise: (models,) W",
    )
    asked = options.parse_args(arguments)
    for name, files in (("--out", asked.out), ("--power", asked.power)):
        if len(files) != len(asked.station):
            raise InputError(
                f"{name}: {len(files)} files, expected one for each of the stations {asked.station}"
            )
    snrs = asked.settings.pop("snr_db", None)
    if snrs is not None:
        snrs = [float(snr) for snr in snrs]
    seed, block, tolerance, effects = pick(
        asked.settings, "seed", "network", "tolerance", "effects"
    )
    scene = Scene(Network.from_settings(block), seed, tolerance, tuple(called(effects)))
    clouds = read_clouds(asked.clouds)
    occluders = {}
    if asked.occluders:
        from lowalt.targets.occluders import read_all

        occluders = read_all(asked.occluders)
    rows = read_table(asked.motion)
    for station, out, power in zip(asked.station, asked.out, asked.power, strict=True):
        signals, powers = scene_signals(scene, station, clouds, rows, occluders, snrs)
        for path, values in ((out, signals), (power, powers)):
            with replacing(path) as temporary:
                np.save(temporary, values)
            print(f"{path}: {len(values)} models", file=sys.stderr)


if __name__ == "__main__":
    run(main)
