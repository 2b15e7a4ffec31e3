"""`python -m lowalt.shards write | index`: pack samples into a shard, list a data set's shards.

`lowalt verify` and `lowalt remake` check what was packed.
"""

from lowalt.config.classes import stated
from lowalt.config.command import dispatch, parser, pick, run
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.motion import read_table
from lowalt.scene.effects import complete
from lowalt.shards.content import clean_content, cube_content, noisy_content
from lowalt.shards.index import build
from lowalt.shards.sample_record import accompanied
from lowalt.shards.sample_table import KINDS
from lowalt.shards.sizes import CELL_BYTES, cell_type
from lowalt.shards.write import ChunkSamples, write_shard
from lowalt.targets.cloud import read_clouds
from lowalt.targets.occluders import read_all


def write(arguments: list[str]) -> None:
    """Write one shard and its table.

    Settings: seed, network, snr_db, split, shards {kind}; also record, the effects that add to the
    record of a sample, in a scene that has them, filters, those that the noise passes, for recipe
    shards, and echo {tolerance, effects} for cube shards.
    """
    line = parser("lowalt.shards write", "Pack the samples of one chunk and fold into a shard.")
    line.add_argument("--motion", required=True, help="the chunk's motion table")
    line.add_argument(
        "--signals", help="the chunk's noisy signals (.npy, complex64); all kinds but recipe"
    )
    line.add_argument("--tiles", help="the chunk's tiles (.npz); image shards")
    line.add_argument(
        "--echoes", nargs="+", help="recipe shards: clean echoes (.npy), one file per station"
    )
    line.add_argument(
        "--powers",
        nargs="+",
        help="recipe shards: powers for the SNRs (.npy), one file per station",
    )
    line.add_argument(
        "--clouds", nargs="*", default=[], help="clouds of the chunk's subtypes; cube shards"
    )
    line.add_argument(
        "--occluders", nargs="*", default=[], help="surfaces of the chunk's subtypes; cube shards"
    )
    line.add_argument("--fold", required=True, help="train, val or test")
    line.add_argument(
        "--piece",
        nargs=2,
        type=int,
        default=(0, 1),
        metavar=("NUMBER", "COUNT"),
        help="the shard's number among the shards of the fold, and their count",
    )
    line.add_argument(
        "--out", required=True, help="shard to write (.tar); its table is the .npz next to it"
    )
    options = line.parse_args(arguments)
    settings = options.settings
    classes = _classes(settings)
    filters = settings.pop("filters", {})
    echo = settings.pop("echo", {})
    recorded = complete(settings.pop("record", {}))
    seed, network, snrs, split, shards = pick(
        settings, "seed", "network", "snr_db", "split", "shards"
    )
    stated_or_default = {"largest_mb": None, "cells": cell_type({"shards": shards}), **shards}
    kind, _, cells = pick(stated_or_default, "kind", "largest_mb", "cells")
    if not 0 <= options.piece[0] < options.piece[1]:
        raise InputError(f"--piece: {options.piece}, expected 0 <= NUMBER < COUNT")
    if kind not in KINDS:
        raise InputError(f"shards.kind is {kind!r}, expected one of {KINDS}")
    if cells not in CELL_BYTES:
        raise InputError(f"shards.cells is {cells!r}, expected one of {list(CELL_BYTES)}")
    scene = {"seed": seed, "network": network, **echo}
    powers = None
    snrs = [float(snr) for snr in snrs]
    network = Network.from_settings(network)
    rows = [accompanied(row, recorded, seed, network) for row in read_table(options.motion)]
    if kind == "recipe":
        content, powers = clean_content(options.echoes, options.powers, network, len(rows))
    elif kind == "cube":
        # With it come the kernels of the echo and of scenes, which take most of a job's start.
        from lowalt.tiles.cubes import Cubes

        clouds = read_clouds(options.clouds)
        occluders = read_all(options.occluders) if options.occluders else None
        cubes = Cubes.from_settings(scene, clouds, occluders)
        content = cube_content(options.signals, cubes, rows, snrs, cells)
    else:
        content = noisy_content(
            kind, options.signals, options.tiles, network, (len(rows), len(snrs))
        )
    samples = ChunkSamples(rows, snrs, split, seed, network, classes, powers, filters)
    write_shard(options.out, samples, options.fold, kind, content, tuple(options.piece))


def _classes(settings: dict) -> tuple[str, ...]:
    """Remove the classes from a command's settings and return them: by default the published."""
    classes = stated(settings)
    settings.pop("classes", None)
    return classes


def index(arguments: list[str]) -> None:
    """Write the index of shards.

    Settings: network, spectra, images (how a loader renders signals), echo {tolerance, effects}
    where it is known, and the classes in the order of their labels where they are not the published
    ones.
    """
    line = parser("lowalt.shards index", "List shards with counts and checksums.")
    line.add_argument(
        "--shards", nargs="+", required=True, help="shards (.tar), their tables next to them"
    )
    line.add_argument("--out", required=True, help="index to write (.json)")
    options = line.parse_args(arguments)
    echo = options.settings.pop("echo", None)
    classes = _classes(options.settings)
    pick(options.settings, "network", "spectra", "images")
    build(options.shards, options.settings, options.out, echo, classes)


COMMANDS = {"write": write, "index": index}


def main(arguments: list[str]) -> None:
    """Run one command of the stage."""
    dispatch("lowalt.shards", COMMANDS, arguments)


if __name__ == "__main__":
    run(main)
