"""A radar that no choice was made for: a recogniser out of one record, asked about public
recordings of cars.

    python studies/measured/fourth_radar.py --inputs FOLDER --out results/measured

`lowalt recording train` simulates an HB100 module (10.525 GHz, one real channel) by the record of
one recording (`fourth_radar.yaml`), of which it takes the noise floor alone, and trains one network
for each training seed (`hb100-SEED`). Simulated windows are drawn by the network's name, so each
network learns from windows of its own. The table measured-fourth.csv has the labelled windows of
each recording by what `lowalt predict` says of them with each network, and with `KNOWN`, which
learned another radar near that carrier. The recordings were used for no decision.
"""

import argparse
from pathlib import Path

import numpy as np
from accuracy import COUNTED, counts, said_of, window_s
from labels import intervals_of, read_labels

from lowalt.config.command import run
from lowalt.extensions.recordings.answers import answers
from lowalt.extensions.recordings.own_radar import trained_radar
from lowalt.extensions.recordings.presence import strongest_mps
from lowalt.extensions.recordings.record import record
from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_training import RECOGNITION, settings
from lowalt.extensions.recordings.windows import looks
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition.runs import opened

RECORDS = Path(__file__).with_name("fourth_radar.yaml")
KNOWN = "bird_drone_10ghz"
COLUMNS = (
    "network",
    "file",
    "label",
    "slower_or_faster",
    "windows",
    *COUNTED,
    "right_percent",
    "named_percent",
)
SLOW_MPS = 1.0
"""Speed of a window's strongest line that parts the windows of each file."""


def rows(model: str, inputs: Path) -> list[list]:
    """Return the rows of `COLUMNS` of all recordings by a model, a file or a name of the zoo: of
    each label, the windows whose strongest line is slower than `SLOW_MPS`, and the others."""
    trained, made_with = opened(model)
    labels = read_labels()
    result = []
    for block in load_yaml(RECORDS, "records")["records"]:
        about = record(block, inputs, block["file"])
        twin = Twin.from_settings(made_with["radar"]).at_carrier(about.carrier_hz)
        said = answers(trained, made_with, about, block["file"])
        intervals = intervals_of(labels, *Path(block["file"]).parts)
        found = said_of(said, list(trained.classes), window_s(twin), intervals)
        strongest = strongest_mps(looks(about, twin).intervals, twin)
        slow = strongest[np.isin(said.starts_s, found.starts_s)] < SLOW_MPS
        for words, chosen in (
            (f"below {SLOW_MPS:g} m/s", slow),
            (f"from {SLOW_MPS:g} m/s on", ~slow),
        ):
            for label in dict.fromkeys(found.labels):
                outcomes = [
                    outcome
                    for outcome, one, taken in zip(
                        found.outcomes, found.labels, chosen, strict=True
                    )
                    if taken and one == label
                ]
                if outcomes:
                    result.append(
                        [trained.path.stem, block["file"], label, words, *counts(label, outcomes)]
                    )
    return result


def main(arguments: list[str]) -> None:
    """Train the recognisers, name the recordings and write the table."""
    line = argparse.ArgumentParser(prog="fourth_radar.py", description=main.__doc__)
    line.add_argument("--inputs", required=True, type=Path, help="folder of the recordings")
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    line.add_argument(
        "--recognition", default=RECOGNITION, help=f"network and training (default: {RECOGNITION})"
    )
    options = line.parse_args(arguments)
    first = load_yaml(RECORDS, "records")["records"][0]
    about = record(first, options.inputs, first["file"])
    block = settings(options.recognition)
    models = []
    for seed in block["seeds"]:
        expected = trained_radar(about, options.out / f"hb100-{seed}", {**block, "seeds": [seed]})
        print(
            f"seed {seed}: {expected['percent']:.1f} % of {expected['windows']} simulated windows"
            " are right"
        )
        models.append(str(expected["file"]))
    found = [row for model in (*models, KNOWN) for row in rows(model, options.inputs)]
    write_csv(options.out / "measured-fourth.csv", COLUMNS, found)
    for row in found:
        print(
            f"{row[0]}, {row[1]}, {row[3]}: {row[-2]:.1f} % of {row[4]} windows of {row[2]} are"
            " right"
        )


if __name__ == "__main__":
    run(main)
