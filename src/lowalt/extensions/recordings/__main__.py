"""`python -m lowalt.extensions.recordings import`: one recording as windows, spectra and tiles."""

import argparse
from pathlib import Path

from lowalt.config.command import dispatch, run
from lowalt.config.layers import load_yaml
from lowalt.extensions.recordings.record import read_record
from lowalt.extensions.recordings.twin import RADARS, radars
from lowalt.extensions.recordings.windows import write
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped

IMAGES = "config/default.yaml"


def import_(arguments: list[str]) -> None:
    """Turn one recording into signals, spectra, tiles and, with a label, a shard and its index."""
    line = argparse.ArgumentParser(prog="python -m lowalt.extensions.recordings import", description=import_.__doc__)
    line.add_argument("--radars", default=RADARS, help=f"folder of the records of radars (default: {RADARS})")
    line.add_argument("--record", required=True, type=Path, help="record of the recording (.yaml)")
    line.add_argument("--radar", required=True, help="the twin whose symbol rate the signals get")
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    options = line.parse_args(arguments)
    twins, record = radars(options.radars), read_record(options.record)
    if options.radar not in twins:
        raise InputError(f"--radar {options.radar!r}: no such twin, expected one of {sorted(twins)}")
    count = write(record, twins[options.radar], load_yaml(shipped(IMAGES))["images"], options.out)
    print(f"{options.out}: {count} windows of {record.file.name}")


def main(arguments: list[str]) -> None:
    """Run one command of the stage."""
    dispatch("lowalt.extensions.recordings", {"import": import_}, arguments)


if __name__ == "__main__":
    run(main)
