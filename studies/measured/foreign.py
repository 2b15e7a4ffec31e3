"""What networks say of what they did not learn: noise, a waving hand, and cars in front of other
radars.

    python studies/measured/foreign.py --inputs FOLDER --out FOLDER [--models MODEL ...]

Some inputs are simulated at each network's own carrier, rate and channel: white noise, and a hand
that waves in front of a body that stands still (`hand`). The others are public recordings
(`foreign.yaml`). The table measured-foreign.csv has one row a network and input, with the number of
windows by what `lowalt predict` says. A recording at another carrier is refused: its windows are 0.
"""

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
from accuracy import COUNTED

from lowalt.config.command import run
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.answers import Answers, answers
from lowalt.extensions.recordings.record import Record, record
from lowalt.extensions.recordings.twin import Twin, radars
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.numerics.streams import stream
from lowalt.recognition.runs import opened

RECORDS = Path(__file__).with_name("foreign.yaml")
COLUMNS = ("network", "input", "windows", *COUNTED)
SECONDS = 12.0
SEED = 20260701
HAND_M = 0.15
HAND_HZ = 1.2
DISTANCE_M = 0.8
HAND_DB = 20.0
"""How far the hand's echo stands above the noise of the receiver's band."""


def hand(twin: Twin, share: float, rng: np.random.Generator) -> np.ndarray:
    """Return the samples (n,) complex128 of a hand that moves to and fro by `HAND_M`, `HAND_HZ`
    times a second, in the last `share` of the time, and of a body behind it that stands still, ten
    times as strong, in white noise of unit power."""
    times = np.arange(round(SECONDS * twin.rate_hz)) / twin.rate_hz
    wave = 4 * np.pi * twin.carrier_hz / SPEED_OF_LIGHT
    distance_m = DISTANCE_M + HAND_M * np.sin(
        2 * np.pi * HAND_HZ * np.maximum(times - (1 - share) * SECONDS, 0)
    )
    size = 10 ** (HAND_DB / 20)
    body = np.sqrt(10) * size * np.exp(-1j * wave * (DISTANCE_M + 0.4))
    return size * np.exp(-1j * wave * distance_m) + body + noise(len(times), rng)


def noise(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return circular white noise (count,) complex128 of unit power."""
    pair = rng.standard_normal((2, count)) * np.sqrt(0.5)
    return pair[0] + 1j * pair[1]


def inputs_of(twin: Twin, recorded: Path, folder: Path) -> Iterator[tuple[str, Record]]:
    """Yield the name and record of each input of a radar; recorded: folder of the recordings;
    folder: for samples.
    """
    yield from simulated_inputs(twin, folder)
    yield from recorded_inputs(recorded, folder)


def simulated_inputs(twin: Twin, folder: Path) -> Iterator[tuple[str, Record]]:
    """Yield the name and record of each simulated input of a radar; folder: for samples."""
    count = round(SECONDS * twin.rate_hz)
    simulated = {
        "white noise": lambda rng: noise(count, rng),
        "simulated hand that waves half of the time": lambda rng: hand(twin, 0.5, rng),
        "simulated hand that waves all the time": lambda rng: hand(twin, 1.0, rng),
    }
    about = {"carrier_hz": twin.carrier_hz, "rate_hz": twin.rate_hz, "channel": twin.channel}
    for name, made in simulated.items():
        values = made(stream(SEED, "foreign", name, int(twin.carrier_hz)))
        np.save(folder / "samples.npy", values if twin.channel == "complex" else values.real)
        yield name, record({"file": "samples.npy", **about}, folder, name)


def recorded_inputs(recorded: Path, folder: Path) -> Iterator[tuple[str, Record]]:
    """Yield the name and record of each recorded input that is there; arguments: as `inputs_of`."""
    for block in load_yaml(RECORDS, "records")["records"]:
        name = block.pop("what")
        if not (recorded / block["file"]).is_file():
            print(f"{name}: {block['file']} is not there, left out")
            continue
        distance = block.pop("distance", None)
        if distance is None:
            yield name, record(block, recorded, name)
            continue
        np.save(folder / "samples.npy", sweeps(recorded / block["file"], distance))
        yield name, record({**block, "file": "samples.npy"}, folder, name)


def sweeps(path: Path, distance: int) -> np.ndarray:
    """Return the samples (n,) complex128 at one distance out of a file of acconeer's exploration
    tool, whose array has the axes frames, sweeps and distances.

    The sensor measured in continuous sweep mode: no time passes between two frames.
    Source: the documentation of the tool.
    """
    with h5py.File(path) as file:
        frames = file["sessions/session_0/group_0/entry_0/result/frame"][()]
    at_distance = frames[:, :, distance].ravel()
    return at_distance["real"] + 1j * at_distance["imag"]


def row(network: str, name: str, said: Answers | None, classes: list[str]) -> list:
    """Return a row of `COLUMNS` from what a network of some classes says, None where it is not
    asked.
    """
    outcomes = said.outcomes(classes) if said else []
    return [network, name, len(outcomes), *(outcomes.count(one) for one in COUNTED)]


def main(arguments: list[str]) -> None:
    """Ask every network about every input and write the table."""
    line = argparse.ArgumentParser(prog="foreign.py", description=main.__doc__)
    line.add_argument("--inputs", required=True, type=Path, help="folder of the recordings")
    line.add_argument("--out", required=True, type=Path, help="folder to write")
    line.add_argument(
        "--models", nargs="+", default=list(radars()), help="files of networks, or names of the zoo"
    )
    options = line.parse_args(arguments)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for model in options.models:
            trained, settings = opened(model)
            twin = Twin.from_settings(settings["radar"])
            for name, about in inputs_of(twin, options.inputs, Path(folder)):
                said = (
                    answers(trained, settings, about, name) if twin.near(about.carrier_hz) else None
                )
                rows.append(row(trained.path.stem, name, said, list(trained.classes)))
                print(*rows[-1], sep=", ", flush=True)
    write_csv(options.out / "measured-foreign.csv", COLUMNS, rows)


if __name__ == "__main__":
    run(main)
