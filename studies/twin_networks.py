"""Networks of measured radars, which learn from simulated windows of their twins alone.

    python studies/twin_networks.py --models FOLDER --out results/zoo

keeps a network of every radar in a zoo, from where `lowalt predict` takes it, in 8 bits; one that FOLDER lacks is
trained first. The images are those of the data set: spectra, tiles and shrinking by the same functions, one station.
Recordings are never trained or validated on.
"""

import argparse
from dataclasses import asdict, replace
from pathlib import Path

from lowalt.config.command import run
from lowalt.recognition import zoo
from lowalt.recognition.model_file import of_run
from lowalt.recordings.twin import TWINS
from lowalt.recordings.twin_scenes import Library
from lowalt.recordings.twin_training import RECOGNITION, settings, simulated, train


def main(arguments: list[str]) -> None:
    """Keep a network of every radar in a zoo, in 8 bits; one that --models lacks is trained on its twin first."""
    line = argparse.ArgumentParser(prog="twin_networks.py", description=main.__doc__)
    line.add_argument("--twins", default=TWINS, help=f"radars and scenes (default: {TWINS})")
    line.add_argument("--recognition", default=RECOGNITION, help=f"network and training (default: {RECOGNITION})")
    line.add_argument("--models", required=True, type=Path, help="folder of networks, RADAR-SEED/model.pt")
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    options = line.parse_args(arguments)
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


if __name__ == "__main__":
    run(main)
