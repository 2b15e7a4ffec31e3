"""Which change of a target's geometry or gait moves its recognition: `python variants.py RUN OUT.csv`.

RUN is a finished run whose networks were trained on the other subtypes (protocol unseen, three stations). Each variant
changes one figure of a record back, or the paths of a pedestrian's nodes to those that `read.py` read, and the run's
networks are asked about 40 new motion models of each subtype at 13 dB.
"""

import copy
import csv
import dataclasses
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
import yaml

from lowalt.config.layers import load
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition.predict_sample import answer
from lowalt.recognition.runs import load as load_model
from lowalt.shards.dataset import Dataset
from lowalt.targets.cloud import Cloud
from lowalt.targets.make import make
from lowalt.targets.records import records_of
from lowalt.targets.skeleton import NODES, rotation
from lowalt.tiles import split

ROOT = Path(__file__).parents[2]
EH, SPARROW = "EH 216 S", "Sparrow"
WALKERS = (*(f"Walking Pedestrian {number}" for number in (5, 6, 7)), "Running Pedestrian 2")
"""The pedestrians that the networks have not seen, without the one whose dots are followed badly."""


def read_paths(subtype: str) -> np.ndarray:
    """Return the paths (K, 31, 3) m of a pedestrian's nodes over a cycle, as read from the authors' video."""
    with (Path(__file__).parent / "paths.csv").open() as file:
        rows = [row for row in csv.reader(file) if row[0].endswith(subtype.replace(" ", "_"))]
    return np.array([row[2:] for row in rows], float).reshape(len(rows), len(NODES), 3) / 1000


def still(cloud: Cloud) -> Cloud:
    """Return a pedestrian whose root stays in its place, as the authors' does: it neither bobs nor sways."""
    return with_track(cloud, cloud.track - cloud.track[:, :1])


def bent(cloud: Cloud) -> Cloud:
    """Return a pedestrian whose elbows are bent more, by as much as the read mean bend exceeds ours."""
    track = cloud.track.copy()
    theirs = read_paths(cloud.subtype)
    for side in "lr":
        elbow, below = NODES.index(f"{side}humerus"), [NODES.index(side + name) for name in BELOW_ELBOW]
        more = elbow_bend(theirs, side).mean() - elbow_bend(track, side).mean()
        track[:, below] = (track[:, below] - track[:, [elbow]]) @ rotation("x", more).T + track[:, [elbow]]
    return with_track(cloud, track)


def on_read_paths(cloud: Cloud) -> Cloud:
    """Return a pedestrian whose nodes all are on the paths that were read, at the rate of our own cycle."""
    theirs, frames = read_paths(cloud.subtype), len(cloud.track)
    # The series of a cycle, with zeros for higher frequencies: the same curve at more moments.
    track = np.fft.irfft(np.fft.rfft(theirs, axis=0), frames, axis=0) * frames / len(theirs)
    return with_track(cloud, track)


def with_track(cloud: Cloud, track: np.ndarray) -> Cloud:
    """Return a pedestrian with other paths (F, 31, 3) m of its nodes."""
    return dataclasses.replace(cloud, track=track, points=track[0].copy())


BELOW_ELBOW = ("radius", "wrist", "hand", "fingers", "thumb")


def elbow_bend(track: np.ndarray, side: str) -> np.ndarray:
    """Return the bend (F,) rad of an elbow, 0 for a straight arm; track: (F, 31, 3), side: l or r."""
    shoulder, elbow, wrist = (track[:, NODES.index(side + name)] for name in ("clavicle", "humerus", "radius"))
    upper, lower = elbow - shoulder, wrist - elbow
    cosine = (upper * lower).sum(1) / np.linalg.norm(upper, axis=1) / np.linalg.norm(lower, axis=1)
    return np.arccos(np.clip(cosine, -1, 1))


VARIANTS = (
    (EH, "as the authors show it", {}),
    (EH, "40 % of the points on rotors", {"moving_share": 0.4}),
    (EH, "blades of 0.7 m", {"propeller_diameter": 1.42}),
    (EH, "the maker's cabin", {"body_length": 2.6, "body_width": 1.6, "body_height": 1.55}),
    (EH, "the maker's hubs and blades", {"motor_diagonal": 3.85, "propeller_diameter": 1.42}),
    (SPARROW, "as the authors show it", {}),
    (SPARROW, "62 % of the points on wings", {"moving_share": 0.62}),
    (SPARROW, "the former wing beat", {"flap": {"mean_deg": 15, "amplitude_deg": 40}}),
    (SPARROW, "the living bird's span", {"span": 0.237}),
    (WALKERS, "as built", lambda cloud: cloud),
    (WALKERS, "root held still", still),
    (WALKERS, "elbows bent as read", bent),
    (WALKERS, "all nodes on the read paths", on_read_paths),
)
"""Subtype or subtypes, what is changed, and the keys of the record that are changed or a function of the cloud."""
MODELS, SNR_DB = 40, 13.0


def changed(subtype: str, changes: dict) -> dict:
    """Return the record of a subtype with some of its keys or figures changed."""
    file = "uav.yaml" if subtype == EH else "bird.yaml"
    record = copy.deepcopy(load_yaml(ROOT / "config/targets" / file)[subtype])
    for key, value in changes.items():
        if key in record["figures"]:
            record["figures"][key][0] = value
        else:
            record[key] = value
    return {subtype: record}


def samples_of(subtype: str, changes, folder: Path) -> Dataset:
    """Return new samples of a changed subtype; changes as in `VARIANTS`."""
    config = load([ROOT / "config/default.yaml"], ROOT / "workflow/schemas/config.schema.yaml")
    config["targets"]["select"] = [subtype]
    config["motion"] |= {"models": MODELS, "models_per_chunk": MODELS}
    config["noise"]["snr_db"] = [SNR_DB]
    if callable(changes):
        cloud = make(records_of(config["targets"])[subtype], None, config["seed"])
        return Dataset(config, {subtype: changes(cloud)})
    path = folder / "variant.yaml"
    path.write_text(yaml.safe_dump(changed(subtype, changes)))
    config["targets"]["records"] = [*config["targets"]["records"], str(path)]
    return Dataset(config)


def main(run: Path, out: Path) -> None:
    """Ask the run's networks about every variant and write the shares of their answers."""
    networks = [load_model(path) for path in sorted(run.glob("models/unseen/abc-vrp-trp-vt/*/model.safetensors"))]
    rows = []
    for subtypes, words, changes in VARIANTS:
        subtypes = [subtypes] if isinstance(subtypes, str) else subtypes
        told: Counter = Counter()
        for subtype in subtypes:
            with tempfile.TemporaryDirectory() as folder:
                samples = samples_of(subtype, changes, Path(folder))
                for number in range(len(samples)):
                    images = split(samples[number][0], len(samples.config["spectra"]))
                    for network in networks:
                        said = answer(network, images, samples.config, subtype)
                        told[max(said, key=said.__getitem__)] += 1
        shares = {name: f"{100 * told[name] / told.total():.0f}" for name in samples.classes}
        rows.append({"subtype": " and ".join(subtypes), "variant": words, **shares})
        print(rows[-1], file=sys.stderr)
    write_csv(out, list(rows[0]), rows)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
