"""`python -m lowalt.recordings import | pairs | compare | recognise | ablate | keep`.

`import` reads one recording of a user. The other commands read the folder of measured sets and compare the recordings
with the simulated twins of their radars; `keep` puts the networks that `recognise` trained into the zoo.
"""

import argparse
import os
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import numpy as np

from lowalt.config.command import dispatch, run
from lowalt.config.layers import load_yaml
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.machine.side_by_side import together
from lowalt.recordings import compare, samples
from lowalt.recordings.library import Library
from lowalt.recordings.pairs import pair_of
from lowalt.recordings.recognise import settings
from lowalt.recordings.record import read_record
from lowalt.recordings.sets import HALVES, Measured, recordings, usable
from lowalt.targets.records import load_records

FOLDER = "config/measured"


def _line(name: str, description: str, *, inputs: bool = False, record: bool = True) -> argparse.ArgumentParser:
    """A parser with the arguments that all commands share, and with those of the measured sets or of one record."""
    options = argparse.ArgumentParser(prog=f"python -m lowalt.recordings {name}", description=description)
    options.add_argument("--twins", type=shipped, default=f"{FOLDER}/twins.yaml", help="radars and scenes")
    options.add_argument(
        "--recognition", type=shipped, default=f"{FOLDER}/recognition.yaml", help="network and training"
    )
    options.add_argument("--out", required=True, type=Path, help="folder to write")
    if inputs:
        options.add_argument("--inputs", required=True, type=Path, help="folder of the measured sets")
        options.add_argument("--sets", type=shipped, default=f"{FOLDER}/sets.yaml")
        options.add_argument("--split", type=shipped, default=f"{FOLDER}/split.yaml")
        options.add_argument("--pairs", type=shipped, default=f"{FOLDER}/pictures.yaml")
    elif record:
        options.add_argument("--record", required=True, type=Path, help="record of the recording (.yaml)")
        options.add_argument("--radar", required=True, help="the twin whose symbol rate the signals get")
    return options


def _found(given: argparse.Namespace, library: Library) -> list[Measured]:
    """The usable recordings below the folder of inputs."""
    twins = {name: library.twins[twin] for twin, sets in library.sets.items() for name in sets}
    return usable(recordings(given.inputs, given.sets, given.split), twins)


def _twin(library: Library, name: str):
    """The radar of this name. Raises: InputError where the library has none."""
    if name not in library.twins:
        raise InputError(f"--radar {name!r}: no such twin, expected one of {sorted(library.twins)}")
    return library.twins[name]


def import_(arguments: list[str]) -> None:
    """Turn one recording into signals, spectra, tiles and, with a label, a shard and its index."""
    given = _line("import", import_.__doc__).parse_args(arguments)
    library, record = Library.read(given.twins), read_record(given.record)
    count = samples.write(record, _twin(library, given.radar), settings(given.recognition)["images"], given.out)
    print(f"{given.out}: {count} windows of {record.file.name}")


def pairs(arguments: list[str]) -> None:
    """Compute the pairs of pictures, measured and simulated, into one pair-NAME.npz each."""
    given = _line("pairs", pairs.__doc__, inputs=True).parse_args(arguments)
    block, found = load_yaml(given.pairs), _found(given, Library.read(given.twins))
    records = load_records(block["targets"]["table"], block["targets"]["records"])
    for name, pair in block["pairs"].items():
        before = {**pair, "scene": compare.plain(pair["scene"], block["mended"])}
        drawn = [pair_of(name, version, found, records, block["seed"]) for version in (before, pair)]
        if drawn[1] is None:
            print(f"{name}: {pair['file']} is not there, left out")
            continue
        (measured, simulated), plain = drawn[1], drawn[0][1]
        with replacing(given.out / f"pair-{name}.npz") as temporary:
            np.savez(
                temporary, caption=np.array(pair["caption"]), times_s=measured.times_s, speeds_mps=measured.speeds_mps,
                measured=measured.level_db.astype(np.float32), simulated=simulated.level_db.astype(np.float32),
                before=plain.level_db.astype(np.float32),
            )  # fmt: skip


def compare_(arguments: list[str]) -> None:
    """Compute measured-figures.csv, measured-files.csv and measured-distances.csv."""
    options = _line("compare", compare_.__doc__, inputs=True)
    options.add_argument("--count", type=int, default=60, help="simulated intervals a class")
    options.add_argument("--recorded", default=f"{FOLDER}/recorded.yaml", help="scenes as they were recorded")
    given = options.parse_args(arguments)
    library, recorded = Library.read(given.twins), Library.read(given.recorded)
    block, found = load_yaml(given.pairs), _found(given, library)
    rows, files = [], []
    for name, pair in block["pairs"].items():
        more = compare.class_figures(name, pair, found, library.records, block)
        rows += more[0]
        files += more[1]
    apart = [
        row
        for name in library.twins
        for row in compare.distances(name, found, library, recorded, block["mended"], given.count)
    ]
    samples.write_table(given.out / "measured-figures.csv", compare.FIGURES, rows)
    samples.write_table(given.out / "measured-files.csv", ("pair", "half", "file", "figure", "value"), files)
    samples.write_table(given.out / "measured-distances.csv", compare.DISTANCES, apart)


def recognise(arguments: list[str]) -> None:
    """Train networks on the twins, test them on recordings: measured-recognition.csv and measured-accuracy.csv."""
    options = _line("recognise", recognise.__doc__, inputs=True)
    options.add_argument("--models", required=True, type=Path, help="folder for the trained networks")
    options.add_argument(
        "--halves", nargs="+", default=HALVES, choices=HALVES, help="halves of the split that are read"
    )
    options.add_argument("--reuse", action="store_true", help="take the networks that --models holds, train none")
    options.add_argument("--jobs", type=int, default=os.cpu_count(), help="radars at a time")
    given = options.parse_args(arguments)
    from lowalt.recordings.reality import ACCURACY, RECOGNITION, accuracy, radar

    library, block = Library.read(given.twins), settings(given.recognition)
    found = [one for one in _found(given, library) if one.half in given.halves]
    names = list(library.twins)
    # The radars do not depend on each other, so neither their order nor the number of processes changes a result. The
    # last radar takes longest, so it starts first.
    shared = found, library, block, given.models, given.out, given.reuse
    calls = [partial(radar, name, *shared) for name in reversed(names)]
    rows = [row for rows in reversed(together(calls, given.jobs, "spawn")) for row in rows]
    samples.write_table(given.out / "measured-recognition.csv", RECOGNITION, rows)
    samples.write_table(given.out / "measured-accuracy.csv", ACCURACY, accuracy(rows, block["seed"]))


def ablate(arguments: list[str]) -> None:
    """Train networks without one randomisation each and test them on the tuning half: measured-ablation.csv."""
    options = _line("ablate", ablate.__doc__, inputs=True)
    options.add_argument("--ablation", type=shipped, default=f"{FOLDER}/ablation.yaml", help="what is left out")
    options.add_argument("--models", required=True, type=Path, help="folder for the trained networks")
    given = options.parse_args(arguments)
    from lowalt.recordings.ablate import ABLATION, ablation

    library, own = Library.read(given.twins), load_yaml(given.ablation, "ablation")
    block = settings(given.recognition) | {key: own[key] for key in ("echoes", "receivers", "seeds")}
    block["training"] = block["training"] | {"steps": own["steps"], "validate_every": own["steps"]}
    found = _found(given, library)
    rows = ablation(own["radar"], found, library, block, own["changes"], given.models)
    samples.write_table(given.out / "measured-ablation.csv", ABLATION, rows)


def keep(arguments: list[str]) -> None:
    """Keep a network of every radar in the zoo, in 8 bits; one that --models lacks is trained on its twin first."""
    options = _line("keep", keep.__doc__, record=False)
    options.add_argument("--models", required=True, type=Path, help="folder of networks, as `recognise` writes it")
    given = options.parse_args(arguments)
    from lowalt.recognition import zoo
    from lowalt.recognition.model_file import of_run
    from lowalt.recordings.recognise import simulated, train

    library, block = Library.read(given.twins), settings(given.recognition)
    seed = block["seeds"][0]
    for name, twin in library.twins.items():
        path, validation = given.models / f"{name}-{seed}/model.pt", simulated(library, name, block, "validation")
        if not path.is_file():
            windows = {"train": simulated(library, name, block, "train"), "validation": validation}
            train(block, windows, name, seed, path.parent)
        told = {"network": samples.block(twin), "spectra": samples.spectra_block(twin), "images": block["images"]}
        content = replace(of_run(path), input={**told, "radar": asdict(twin)})
        measured = zoo.kept(content, path, validation, name, given.out)
        print(f"{name}: {measured['percent']:.2f} % of {measured['samples']} simulated windows right")


COMMANDS = {
    "import": import_, "pairs": pairs, "compare": compare_, "recognise": recognise,
    "ablate": ablate, "keep": keep,
}  # fmt: skip


def main(arguments: list[str]) -> None:
    """Run one command of the stage."""
    dispatch("lowalt.recordings", COMMANDS, arguments)


if __name__ == "__main__":
    run(main)
