"""`python -m lowalt.shards write | index | verify`: pack a chunk's samples, list the shards, check every byte."""

import argparse

from lowalt.common.command import parser, pick, run
from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.motion import read_table
from lowalt.shards.index import build
from lowalt.shards.table import KINDS
from lowalt.shards.verify import faults
from lowalt.shards.write import npy, write_shard
from lowalt.tiles.__main__ import load_signals
from lowalt.tiles.files import Tiles


def write(arguments: list[str]) -> None:
    """Write one shard and its table.

    Settings: seed, network, snr_db, split, shards {kind}.
    """
    options = parser("lowalt.shards write", "Pack the samples of one chunk and fold into a shard.")
    options.add_argument("--motion", required=True, help="the chunk's motion table")
    options.add_argument("--signals", required=True, help="the chunk's noisy signals (.npy, complex64)")
    options.add_argument("--tiles", help="the chunk's tiles (.npz); needed for image shards")
    options.add_argument("--fold", required=True, help="train, val or test")
    options.add_argument("--out", required=True, help="shard to write (.tar); its table is the .npz beside it")
    given = options.parse_args(arguments)
    seed, network, snrs, split, shards = pick(given.settings, "seed", "network", "snr_db", "split", "shards")
    (kind,) = pick(shards, "kind")
    if kind not in KINDS:
        raise InputError(f"shards.kind is {kind!r}, expected one of {KINDS}")
    rows, snrs, network = read_table(given.motion), [float(snr) for snr in snrs], Network.from_settings(network)
    signals = load_signals(given.signals, network)
    if signals.shape[:2] != (len(rows), len(snrs)):
        raise InputError(f"{given.signals}: shape {signals.shape}, expected {len(rows)} models and {len(snrs)} SNRs")
    if kind == "image":
        if given.tiles is None:
            raise InputError("--tiles: missing, image shards are packed from them")
        tiles = Tiles(given.tiles)
        if len(tiles) != len(rows) * len(snrs):
            raise InputError(f"{given.tiles}: {len(tiles)} images, expected {len(rows) * len(snrs)}")
        content = lambda number, level: tiles[number * len(snrs) + level]  # noqa: E731
    else:
        content = lambda number, level: npy(signals[number, level])  # noqa: E731
    write_shard(given.out, rows, snrs, split, seed, network, given.fold, kind, content)


def index(arguments: list[str]) -> None:
    """Write the index of shards.

    Settings: network, spectra, images (how a loader renders signals).
    """
    options = parser("lowalt.shards index", "List shards with counts and checksums.")
    options.add_argument("--shards", nargs="+", required=True, help="shards (.tar), their tables beside them")
    options.add_argument("--out", required=True, help="index to write (.json)")
    given = options.parse_args(arguments)
    pick(given.settings, "network", "spectra", "images")
    build(given.shards, given.settings, given.out)


def verify(arguments: list[str]) -> None:
    """Check every byte of a data set; print every fault and end with status 1 where there is one."""
    options = argparse.ArgumentParser(prog="python -m lowalt.shards verify", description=verify.__doc__)
    options.add_argument("--index", required=True, help="the data set's index")
    given = options.parse_args(arguments)
    found = 0
    for line in faults(given.index):
        print(line)
        found += 1
    if found:
        raise SystemExit(1)


COMMANDS = {"write": write, "index": index, "verify": verify}


def main(arguments: list[str]) -> None:
    """Run one command of the stage."""
    if not arguments or arguments[0] not in COMMANDS:
        raise InputError(f"lowalt.shards: {arguments[:1]}, expected one of {list(COMMANDS)}")
    COMMANDS[arguments[0]](arguments[1:])


if __name__ == "__main__":
    run(main)
