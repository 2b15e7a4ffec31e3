"""Recordings of real radars held against the twins of these radars.

    python studies/measured/study.py pairs | compare | noise | recognise | labels --inputs FOLDER
    --out FOLDER python studies/measured/study.py presence | page --out FOLDER

FOLDER of the inputs: one folder a measured set (`sets.yaml`). `--out` gets the tables
measured-*.csv, the pictures and report.html. `recognise` trains networks into the folder
`--models`.
"""

import argparse
import os
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from any_speed import ANY_SPEED, any_speed
from measured_tables import write_measured
from recorded_sets import Measured, recordings, usable

from lowalt.config.command import dispatch, run
from lowalt.extensions.recordings.twin import RADARS
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import read_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.machine.side_by_side import together

HERE = Path(__file__).parent
PAIRS = HERE / "pictures.yaml"


class Inputs(NamedTuple):
    """A command's options, the twins that networks learn from, and the recordings that can be used."""

    options: argparse.Namespace
    library: Library
    recordings: list[Measured]


def _inputs(name: str, description: str, arguments: list[str], *, trains: bool = False) -> Inputs:
    """Read a command's arguments and what they name; trains: whether it has the arguments of a
    training.
    """
    line = argparse.ArgumentParser(f"study.py {name}", description=description)
    line.add_argument("--inputs", required=True, type=Path, help="folder of the measured sets")
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    line.add_argument("--radars", type=Path, default=RADARS, help="folder of the records of radars")
    if name == "compare":
        line.add_argument("--count", type=int, default=60, help="simulated windows per class")
    if trains:
        line.add_argument(
            "--models", type=Path, help="folder of the networks (default: ask those of the zoo)"
        )
        line.add_argument(
            "--recognition", type=Path, default=Path("config/measured/recognition.yaml")
        )
    if name == "recognise":
        line.add_argument(
            "--reuse", action="store_true", help="take the networks that --models holds, train none"
        )
        line.add_argument(
            "--only", type=Path, help="list of files by set (.yaml): take no other recordings"
        )
        line.add_argument(
            "--any-speed", action="store_true", help=f"learn from the scenes of {ANY_SPEED.name}"
        )
        line.add_argument("--jobs", type=int, default=os.cpu_count(), help="radars at a time")
    options = line.parse_args(arguments)
    library = Library.read(options.radars)
    return Inputs(options, library, usable(recordings(options.inputs), library))


def pairs(arguments: list[str]) -> None:
    """Compute the pairs of pictures, measured and simulated, into one pair-NAME.npz each."""
    from comparison import unmended
    from pairs import measured_stretch, picture, simulated_stretch

    from lowalt.extensions.recordings.twin import Twin

    inputs = _inputs("pairs", pairs.__doc__, arguments)
    block = load_yaml(PAIRS)
    records = inputs.library.records
    files = {(recording.set, recording.name): recording for recording in inputs.recordings}
    for name, pair in block["pairs"].items():
        recording = files.get((pair["set"], pair["file"]))
        twin = Twin.from_settings(pair["radar"])
        if recording is None:
            print(f"{name}: {pair['file']} is not there, left out")
            continue
        before = {**pair, "scene": unmended(pair["scene"], block["mended"])}
        measured = picture(
            measured_stretch(recording, twin, pair["start_s"], pair["seconds"]), twin, pair
        )
        sides = {
            side: picture(simulated_stretch(name, drawn, records, block["seed"]), twin, pair)
            for side, drawn in (("simulated", pair), ("before", before))
        }
        with replacing(inputs.options.out / f"pair-{name}.npz") as temporary:
            np.savez(
                temporary,
                caption=np.array(pair["caption"]),
                times_s=measured.times_s,
                speeds_mps=measured.speeds_mps,
                **{
                    side: shown.level_db.astype(np.float32)
                    for side, shown in {"measured": measured, **sides}.items()
                },
            )


def compare(arguments: list[str]) -> None:
    """Compute measured-figures.csv, measured-files.csv and measured-distances.csv."""
    from comparison import DISTANCES, FIGURES, FILES, distance_rows, figure_rows

    inputs = _inputs("compare", compare.__doc__, arguments)
    block = load_yaml(PAIRS)
    options = inputs.options
    library = inputs.library
    recorded = Library.read(options.radars, load_yaml(HERE / "recorded.yaml"))
    parts = [
        figure_rows(name, pair, inputs.recordings, library.records, block)
        for name, pair in block["pairs"].items()
    ]
    apart = [
        distance_rows(name, inputs.recordings, library, recorded, block["mended"], options.count)
        for name in library.twins
    ]
    write_measured(options.out, "figures", FIGURES, [row for rows, _ in parts for row in rows])
    write_measured(options.out, "files", FILES, [row for _, rows in parts for row in rows])
    write_measured(options.out, "distances", DISTANCES, [row for rows in apart for row in rows])


def noise(arguments: list[str]) -> None:
    """Compute measured-noise.csv: the noise floors of the raw recordings with one real channel."""
    inputs = _inputs("noise", noise.__doc__, arguments)
    from noise_floors import NOISE, row

    write_measured(
        inputs.options.out,
        "noise",
        NOISE,
        [row(one) for one in inputs.recordings if one.record.channel == "real"],
    )


def presence(arguments: list[str]) -> None:
    """Compute measured-presence.csv: false alarms in simulated noise, and simulated targets that
    are found.
    """
    line = argparse.ArgumentParser("study.py presence", description=presence.__doc__)
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    line.add_argument("--radars", type=Path, default=RADARS, help="folder of the records of radars")
    line.add_argument("--noises", type=int, default=40, help="recordings of noise a row")
    line.add_argument("--scenes", type=int, default=5, help="recordings of a category")
    options = line.parse_args(arguments)
    from presence_rates import PRESENCE, noise_rows, target_rows

    library = Library.read(options.radars)
    rows = [row for name in library.twins for row in noise_rows(name, library, options.noises)]
    rows += [row for name in library.twins for row in target_rows(name, library, options.scenes)]
    write_measured(options.out, "presence", PRESENCE, rows)


def recognise(arguments: list[str]) -> None:
    """Train networks on the twins and ask them about recordings: measured-windows.csv,
    measured-recognition.csv and measured-accuracy.csv."""
    inputs = _inputs("recognise", recognise.__doc__, arguments, trains=True)
    from accuracy import ACCURACY, RECOGNITION, WINDOWS, accuracy_rows, radar_rows
    from fetch import addresses

    from lowalt.extensions.recordings.twin_training import settings

    options = inputs.options
    library = inputs.library
    over = None
    block = settings(options.recognition)
    if options.any_speed:
        over, learning = any_speed()
        library = Library.read(options.radars, over)
        block = settings(options.recognition, learning)
    named = addresses(load_yaml(options.only, "list of recordings")) if options.only else None
    taken = [one for one in inputs.recordings if named is None or f"{one.set}/{one.name}" in named]
    # The radars do not depend on each other, so neither their order nor the number of processes
    # changes a result. The last radar takes longest, so it starts first.
    calls = [
        partial(radar_rows, name, taken, library, block, options.models, options.reuse)
        for name in reversed(over or library.twins)
    ]
    found = list(reversed(together(calls, options.jobs, "spawn")))
    windows, rows = ([row for of_radar in found for row in of_radar[part]] for part in (0, 1))
    write_measured(options.out, "windows", WINDOWS, windows)
    write_measured(options.out, "recognition", RECOGNITION, rows)
    write_measured(options.out, "accuracy", ACCURACY, accuracy_rows(rows, block["seed"]))


def draw_labels(arguments: list[str]) -> None:
    """Draw the labels of every recording over its spectrogram, and below what networks say of each
    window where measured-windows.csv is there: label-SET-FILE.png."""
    inputs = _inputs("labels", draw_labels.__doc__, arguments)
    from accuracy import WINDOWS, window_s
    from labels import intervals_of, picture, read_labels

    folder = inputs.options.out
    labels = read_labels()
    table = folder / "measured-windows.csv"
    said = read_csv(table, *WINDOWS) if table.is_file() else []
    for recording in inputs.recordings:
        intervals = intervals_of(labels, recording.set, recording.name, recording.record.label)
        of_file = [
            row for row in said if (row["set"], row["file"]) == (recording.set, recording.name)
        ]
        twin = recording.twin(inputs.library)
        outcomes: dict[str, list[tuple[float, str]]] = {}
        for row in of_file:
            outcomes.setdefault(f"network {row['seed']}", []).append(
                (float(row["start_s"]), row["said"])
            )
        image = picture(
            recording.read(), twin.carrier_hz, intervals, recording.name, window_s(twin), outcomes
        )
        with replacing(folder / f"label-{recording.set}-{recording.name}.png") as temporary:
            temporary.write_bytes(image)


def write_page(arguments: list[str]) -> None:
    """Draw the pairs of pictures that there are, then write the page of all tables, report.html."""
    options = argparse.ArgumentParser("study.py page", description=write_page.__doc__)
    options.add_argument(
        "--out", required=True, type=Path, help="folder of measured-*.csv and pair-NAME.npz"
    )
    folder = options.parse_args(arguments).out
    from page import page, pair_picture, read_pair

    pairs = {
        path.stem.removeprefix("pair-"): read_pair(path)
        for path in sorted(folder.glob("pair-*.npz"))
    }
    pictures = {name: pair_picture(pair) for name, pair in pairs.items()}
    if "vehicle" in pairs:
        pictures["short"] = pair_picture(pairs["vehicle"], ("measured", "simulated"))
    for name, picture in pictures.items():
        with replacing(folder / f"measured-{name}.png") as temporary:
            temporary.write_bytes(picture)
    with replacing(folder / "report.html") as temporary:
        temporary.write_text(page(folder))


COMMANDS = {
    "pairs": pairs,
    "compare": compare,
    "noise": noise,
    "presence": presence,
    "recognise": recognise,
    "labels": draw_labels,
    "page": write_page,
}


def main(arguments: list[str]) -> None:
    """Run one command."""
    dispatch("study.py", COMMANDS, arguments)


if __name__ == "__main__":
    run(main)
