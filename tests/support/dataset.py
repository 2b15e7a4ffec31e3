"""A small data set of both groups and all folds, as the commands of the shards make it."""

import json
import math
import shutil

import numpy as np
import yaml

from lowalt.config.network import Network
from lowalt.motion import COLUMNS, write_table
from lowalt.shards import card
from lowalt.shards.__main__ import main
from lowalt.shards.sample_record import npy
from lowalt.shards.write import ChunkSamples, write_shard
from lowalt.tiles import encode, tile_files
from options import words
from pictures import IMAGES, NETWORK, SPECTRA, echoes, renderer

RENDER = {"network": NETWORK, "spectra": SPECTRA, "images": IMAGES}
SPLIT = {"by": "motion", "train": 2, "val": 1, "test": 1}
SNRS = [3, "inf"]
SEED = 11
CONFIG = {"run": "trial", "seed": SEED, "noise": {"snr_db": SNRS}, "split": SPLIT, **RENDER}
"""The configuration of the small data set."""
TARGETS = {"seen": [("DJI Mavic 3", "UAV"), ("Crow", "Bird")], "unseen": [("Model Y", "Vehicle")]}


def motion_rows(group, models=4):
    """Rows of the motion table of a group, two subtypes a motion model."""
    rng = np.random.default_rng(len(group))
    rows = []
    for model in range(models):
        for subtype, category in TARGETS[group]:
            row = dict.fromkeys(COLUMNS, math.nan)
            row.update(
                subtype=subtype,
                category=category,
                group=group,
                model=model,
                rate_hz=rng.uniform(1, 99),
            )
            for name in ("x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"):
                row[name] = rng.uniform(1, 90)
            rows.append(row)
    return rows


def write_settings(kind):
    """Settings of the command `shards write` for a kind of shards, as JSON."""
    block = {
        "seed": SEED,
        "network": NETWORK,
        "snr_db": SNRS,
        "split": SPLIT,
        "shards": {"kind": kind},
    }
    return json.dumps(block)


def write_options(folder, group, kind):
    """What a shard of a kind is packed from; the noiseless level stands for the clean echoes."""
    if kind == "recipe":
        clean = np.load(folder / f"{group}.npy")[:, -1]
        paths = [f"{folder}/{group}.{name}.npy" for name in NETWORK["stations"]]
        for place, path in enumerate(paths):
            np.save(path, clean[:, place])
        return ["--echoes", *paths]
    tiles = ["--tiles", f"{folder}/{group}.tiles.npz"] if kind == "image" else []
    return ["--signals", f"{folder}/{group}.npy", *tiles]


def build(folder, kind, inputs=True):
    """A data set of both groups and all folds: 12 models, two SNRs, one chunk a group.

    inputs: whether motion tables, signals and tiles stay next to the shards.
    """
    folder.mkdir(exist_ok=True)
    shards = []
    for group in TARGETS:
        rows = motion_rows(group)
        write_table(folder / f"{group}.csv", rows)
        signals = np.stack([echoes(seed) for seed in range(2 * len(rows))]).reshape(
            len(rows), 2, 3, 400
        )
        np.save(folder / f"{group}.npy", signals)
        tiles = renderer()
        pngs = [
            encode(tiles.tile(sample), tiles.images.palette)
            for model in signals
            for sample in model
        ]
        tile_files.write(folder / f"{group}.tiles.npz", pngs)
        for name in ("train", "val", "test"):
            shards.append(str(folder / f"{group}-{name}-00000.tar"))
            files = words(motion=folder / f"{group}.csv", fold=name, out=shards[-1])
            content = write_options(folder, group, kind)
            main(["write", "--settings", write_settings(kind), *files, *content])
    options = words(settings=json.dumps(RENDER), shards=shards, out=folder / "index.json")
    main(["index", *options])
    for path in [] if inputs else [*folder.glob("seen.*"), *folder.glob("unseen.*")]:
        path.unlink()
    return folder


def pack(path, rows, fold="train"):
    """A shard of these rows' signals at 3 dB, all dealt to one fold."""
    chunk = ChunkSamples(
        [row | {"fold": fold} for row in rows], [3.0], SPLIT, SEED, Network.from_settings(NETWORK)
    )
    write_shard(path, chunk, fold, "signal", lambda number, _: (npy(echoes(number)), {}))
    return path


def publish(folder, target):
    """A copy of a data set without its inputs, with its data card."""
    copied = shutil.copytree(folder, target, ignore=shutil.ignore_patterns("seen.*", "unseen.*"))
    (target.parent / "config.yaml").write_text(yaml.safe_dump({"run": "trial"}))
    card.write(copied / "index.json", target.parent / "config.yaml")
    return copied
