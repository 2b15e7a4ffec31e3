"""A radar that no choice was made for: a recogniser out of one record, asked about public
recordings of cars.

    python studies/measured/fourth_radar.py --inputs FOLDER --out results/measured

`lowalt recording train` simulates an HB100 module (10.525 GHz, one real channel) by the record of
one recording (`fourth_radar.yaml`), of which it takes the noise floor alone, and trains. The table
measured-fourth.csv has the windows of each recording by class, as this network names them, and as
`KNOWN` does, which learned another radar near that carrier. The recordings were used for no
decision, and the figures are written whatever they are.
"""

import argparse
from pathlib import Path

import numpy as np

from lowalt.config.command import run
from lowalt.extensions.recordings.answers import answers
from lowalt.extensions.recordings.own_radar import trained_radar
from lowalt.extensions.recordings.record import record
from lowalt.extensions.recordings.twin_training import RECOGNITION, settings
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition.runs import opened

RECORDS = Path(__file__).with_name("fourth_radar.yaml")
KNOWN = "bird_drone_10ghz"
COLUMNS = (
    "network",
    "file",
    "label",
    "windows",
    "with_target",
    "UAV",
    "Bird",
    "Vehicle",
    "Pedestrian",
    "right_percent",
)


def rows(model: str, inputs: Path) -> list[list]:
    """Return the rows of `COLUMNS` of all recordings by a model, a file or a name of the zoo; a
    file of no window with a target has no percentage."""
    trained, made_with = opened(model)
    result = []
    for block in load_yaml(RECORDS, "records")["records"]:
        said = answers(trained, made_with, record(block, inputs, block["file"]), block["file"])
        guesses = np.array(trained.classes)[said.probabilities.argmax(1)][said.present]
        counts = [int((guesses == label).sum()) for label in COLUMNS[5:9]]
        right = f"{100 * np.mean(guesses == block['label']):.1f}" if len(guesses) else None
        result.append(
            [
                trained.path.stem,
                block["file"],
                block["label"],
                len(said.present),
                len(guesses),
                *counts,
                right,
            ]
        )
    return result


def main(arguments: list[str]) -> None:
    """Train the recogniser, name the recordings and write the table."""
    line = argparse.ArgumentParser(prog="fourth_radar.py", description=main.__doc__)
    line.add_argument("--inputs", required=True, type=Path, help="folder of the recordings")
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    line.add_argument(
        "--recognition", default=RECOGNITION, help=f"network and training (default: {RECOGNITION})"
    )
    options = line.parse_args(arguments)
    first = load_yaml(RECORDS, "records")["records"][0]
    expected = trained_radar(
        record(first, options.inputs, first["file"]),
        options.out / "hb100",
        settings(options.recognition),
    )
    print(f"expected: {expected['percent']:.1f} % of {expected['windows']} simulated windows right")
    found = [row for model in (str(expected["file"]), KNOWN) for row in rows(model, options.inputs)]
    write_csv(options.out / "measured-fourth.csv", COLUMNS, found)
    for row in found:
        print(
            f"{row[0]}, {row[1]}: {row[-1]} % of {row[4]} windows with a target ({row[3]} in all) say {row[2]}"
        )


if __name__ == "__main__":
    run(main)
