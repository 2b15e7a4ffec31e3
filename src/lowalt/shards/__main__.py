"""`python -m lowalt.shards write | index | verify | remake`: pack samples, list, check and make them again."""

import argparse
from collections.abc import Iterable

from lowalt.config.classes import stated
from lowalt.config.command import dispatch, parser, pick, run
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.motion import read_table
from lowalt.shards.content import clean_content, cube_content, noisy_content
from lowalt.shards.index import build
from lowalt.shards.record import accompanied
from lowalt.shards.table import KINDS
from lowalt.shards.verify import faults
from lowalt.shards.write import ChunkSamples, write_shard
from lowalt.targets.cloud import read as read_cloud
from lowalt.targets.occluders import read_all
from lowalt.tiles.cubes import Cubes


def write(arguments: list[str]) -> None:
    """Write one shard and its table.

    Settings: seed, network, snr_db, split, shards {kind}; also the settings of companions in a scene that has them, and
    those of canceller for recipe shards, and echo {tolerance, effects} for cube shards.
    """
    options = parser("lowalt.shards write", "Pack the samples of one chunk and fold into a shard.")
    options.add_argument("--motion", required=True, help="the chunk's motion table")
    options.add_argument("--signals", help="the chunk's noisy signals (.npy, complex64); image and signal shards")
    options.add_argument("--tiles", help="the chunk's tiles (.npz); image shards")
    options.add_argument(
        "--echoes", nargs="+", help="the chunk's clean echoes (.npy), one file a station; recipe shards"
    )
    options.add_argument(
        "--powers", nargs="+", help="powers that SNRs refer to (.npy), one file a station; recipe shards"
    )
    options.add_argument("--clouds", nargs="*", default=[], help="clouds of the chunk's subtypes; cube shards")
    options.add_argument("--occluders", nargs="*", default=[], help="surfaces of the chunk's subtypes; cube shards")
    options.add_argument("--fold", required=True, help="train, val or test")
    options.add_argument("--piece", nargs=2, type=int, default=(0, 1), metavar=("NUMBER", "COUNT"),
                         help="the shard's place among the shards of the fold")  # fmt: skip
    options.add_argument("--out", required=True, help="shard to write (.tar); its table is the .npz next to it")
    given = options.parse_args(arguments)
    classes = _classes(given.settings)
    canceller = given.settings.pop("canceller", None)
    added = {name: given.settings.pop(name) for name in ("companions",) if name in given.settings}
    echo = given.settings.pop("echo", {})
    seed, network, snrs, split, shards = pick(given.settings, "seed", "network", "snr_db", "split", "shards")
    kind, _ = pick({"largest_mb": None, **shards}, "kind", "largest_mb")
    if not 0 <= given.piece[0] < given.piece[1]:
        raise InputError(f"--piece: {given.piece}, expected 0 <= NUMBER < COUNT")
    if kind not in KINDS:
        raise InputError(f"shards.kind is {kind!r}, expected one of {KINDS}")
    rows = [accompanied(row, added, seed) for row in read_table(given.motion)]
    scene, powers = {"seed": seed, "network": network, **echo}, None
    snrs, network = [float(snr) for snr in snrs], Network.from_settings(network)
    if kind == "cube":
        clouds = {cloud.subtype: cloud for cloud in map(read_cloud, given.clouds)}
        cubes = Cubes.from_settings(scene, clouds, read_all(given.occluders) if given.occluders else None)
        content = cube_content(given.signals, cubes, rows, snrs, network)
    elif kind == "recipe":
        content, powers = clean_content(given.echoes, given.powers, network, len(rows))
    else:
        content = noisy_content(kind, given.signals, given.tiles, network, (len(rows), len(snrs)))
    samples = ChunkSamples(rows, snrs, split, seed, network, classes, powers, canceller)
    write_shard(given.out, samples, given.fold, kind, content, tuple(given.piece))


def _classes(settings: dict) -> tuple[str, ...]:
    """Remove the classes from a command's settings and return them: the published ones if the settings name none."""
    found = stated(settings)
    settings.pop("classes", None)
    return found


def index(arguments: list[str]) -> None:
    """Write the index of shards.

    Settings: network, spectra, images (how a loader renders signals), echo {tolerance, effects} where it is known, and
    the classes in the order of their labels where they are not the published ones.
    """
    options = parser("lowalt.shards index", "List shards with counts and checksums.")
    options.add_argument("--shards", nargs="+", required=True, help="shards (.tar), their tables next to them")
    options.add_argument("--out", required=True, help="index to write (.json)")
    given = options.parse_args(arguments)
    echo = given.settings.pop("echo", None)
    classes = _classes(given.settings)
    pick(given.settings, "network", "spectra", "images")
    build(given.shards, given.settings, given.out, echo, classes)


def _clouds_option(options: argparse.ArgumentParser) -> None:
    """Add the options that name the folders of clouds and surfaces."""
    options.add_argument("--clouds", help="folder of the run's cloud files (default: ../clouds)")
    options.add_argument("--occluders", help="folder of the run's surface files (default: occluders next to clouds)")


def _ended(lines: Iterable[str]) -> None:
    """Print every fault and end with status 1 where there is one."""
    found = 0
    for line in lines:
        print(line)
        found += 1
    if found:
        raise SystemExit(1)


def verify(arguments: list[str]) -> None:
    """Check every byte of a data set; print every fault and end with status 1 where there is one."""
    options = argparse.ArgumentParser(prog="python -m lowalt.shards verify", description=verify.__doc__)
    options.add_argument("--index", required=True, help="the data set's index")
    options.add_argument("--remake", type=int, default=0, metavar="N", help="also make N random samples again")
    _clouds_option(options)
    given = options.parse_args(arguments)
    _ended(faults(given.index))
    if given.remake:
        from lowalt.shards.remake import opened, some

        remaker = opened(given.index, given.clouds, given.occluders)
        _ended(line for number in some(remaker.shards, given.remake) for line in remaker.faults(number))


def remake(arguments: list[str]) -> None:
    """Make samples again from their records; print each difference, and end with status 1 if there is one."""
    options = argparse.ArgumentParser(prog="python -m lowalt.shards remake", description=remake.__doc__)
    options.add_argument("--index", required=True, help="the data set's index")
    options.add_argument("--sample", required=True, nargs="+", metavar="KEY", help="keys of the samples")
    _clouds_option(options)
    given = options.parse_args(arguments)
    from lowalt.shards.remake import number_of, opened

    remaker = opened(given.index, given.clouds, given.occluders)
    _ended(line for key in given.sample for line in remaker.faults(number_of(remaker.shards, key)))
    print(f"{len(given.sample)} samples made again, equal in every byte")


COMMANDS = {"write": write, "index": index, "verify": verify, "remake": remake}


def main(arguments: list[str]) -> None:
    """Run one command of the stage."""
    dispatch("lowalt.shards", COMMANDS, arguments)


if __name__ == "__main__":
    run(main)
