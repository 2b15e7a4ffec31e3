"""`python -m lowalt.recordings import | keep`.

`import` turns one recording into windows, spectra and tiles; `keep` trains the networks of radars' twins and puts them
into a zoo, from where `lowalt predict` takes them.
"""

import argparse
from dataclasses import asdict, replace
from pathlib import Path

from lowalt.config.command import dispatch, run
from lowalt.config.layers import load_yaml
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.recordings.library import Library
from lowalt.recordings.record import read_record
from lowalt.recordings.windows import write

IMAGES = "config/default.yaml"


def _line(name: str, description: str) -> argparse.ArgumentParser:
    """A parser with the arguments that both commands have."""
    line = argparse.ArgumentParser(prog=f"python -m lowalt.recordings {name}", description=description)
    line.add_argument("--twins", type=shipped, default="config/measured/twins.yaml", help="radars and scenes")
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    return line


def import_(arguments: list[str]) -> None:
    """Turn one recording into signals, spectra, tiles and, with a label, a shard and its index."""
    line = _line("import", import_.__doc__)
    line.add_argument("--record", required=True, type=Path, help="record of the recording (.yaml)")
    line.add_argument("--radar", required=True, help="the twin whose symbol rate the signals get")
    options = line.parse_args(arguments)
    twins, record = Library.read(options.twins).twins, read_record(options.record)
    if options.radar not in twins:
        raise InputError(f"--radar {options.radar!r}: no such twin, expected one of {sorted(twins)}")
    count = write(record, twins[options.radar], load_yaml(shipped(IMAGES))["images"], options.out)
    print(f"{options.out}: {count} windows of {record.file.name}")


def keep(arguments: list[str]) -> None:
    """Keep a network of every radar in the zoo, in 8 bits; one that --models lacks is trained on its twin first."""
    line = _line("keep", keep.__doc__)
    line.add_argument("--models", required=True, type=Path, help="folder of networks, RADAR-SEED/model.pt")
    line.add_argument(
        "--recognition", type=shipped, default="config/measured/recognition.yaml", help="network and training"
    )
    options = line.parse_args(arguments)
    from lowalt.recognition import zoo
    from lowalt.recognition.model_file import of_run
    from lowalt.recordings.twin_network import settings, simulated, train

    library, block = Library.read(options.twins), settings(options.recognition)
    seed = block["seeds"][0]
    for name, twin in library.twins.items():
        path, validation = options.models / f"{name}-{seed}/model.pt", simulated(library, name, block, "validation")
        if not path.is_file():
            windows = {"train": simulated(library, name, block, "train"), "validation": validation}
            train(block, windows, name, seed, path.parent)
        made_with = {"network": twin.network_settings(), "spectra": twin.spectra_settings(), "images": block["images"]}
        content = replace(of_run(path), input={**made_with, "radar": asdict(twin)})
        measured = zoo.kept(content, path, validation, name, options.out)
        print(f"{name}: {measured['percent']:.2f} % of {measured['samples']} simulated windows right")


def main(arguments: list[str]) -> None:
    """Run one command of the stage."""
    dispatch("lowalt.recordings", {"import": import_, "keep": keep}, arguments)


if __name__ == "__main__":
    run(main)
