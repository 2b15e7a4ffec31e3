"""Writes a whole data set in one process, with the same bytes as the workflow.

`python -m lowalt.shards.build` writes clouds, motion tables and shards; echoes are only kept in
memory.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from lowalt.config.brought import OF_TRAINING
from lowalt.config.command import run
from lowalt.config.layers import SCHEMA, load
from lowalt.files.atomic import slug
from lowalt.motion.table import write_table
from lowalt.scene.set_noise import filters
from lowalt.shards.clean import refuse
from lowalt.shards.dataset import Dataset, Place
from lowalt.shards.index import build
from lowalt.shards.sample_record import npy
from lowalt.shards.sizes import cell_type
from lowalt.shards.write import ChunkSamples, write_shard
from lowalt.targets.cloud import write as write_cloud


def write_run(dataset: Dataset, folder: str | Path, kind: str, clouds: bool = True) -> dict:
    """Write all shards of a data set, its motion tables and clouds; return the index.

    The files lie below `folder` as the workflow writes them.
    kind: "image", "signal", "recipe" or "cube"; clouds: whether cloud files are written too.
    Raises: InputError naming the sample that cannot be computed.
    """
    folder = Path(folder)
    plan = dataset.plan
    if clouds:
        for group in plan.groups.values():
            for subtype in group:
                write_cloud(folder / "clouds" / f"{slug(subtype)}.npz", dataset.clouds[subtype])
    written = []
    for chunk in plan.chunks:
        written += write_chunk(dataset, folder, chunk, kind)
        print(f"{chunk}: written", file=sys.stderr)
    maker = dataset.maker
    out = folder / "shards" / "index.json"
    return build(written, maker.render, out, maker.echo, dataset.classes)


def rows_of(dataset: Dataset, chunk: str) -> list[dict]:
    """Return the motion table of one chunk."""
    group, _, _ = chunk.partition("-")
    held = dataset.plan.chunk(chunk)
    rows = []
    for model in range(held.first, held.first + held.count):
        for subtype in held.members:
            rows.append(dataset.row(Place(group, subtype, model, 0.0)))
    return rows


def write_chunk(dataset: Dataset, folder: Path, chunk: str, kind: str) -> list[Path]:
    """Write the motion table and the shards of one chunk; return the shards' paths."""
    plan = dataset.plan
    maker = dataset.maker
    rows = rows_of(dataset, chunk)
    cells = cell_type(dataset.config)
    levels = plan.chunk(chunk).snrs
    group, _, chunk_number = chunk.partition("-")
    if chunk in plan.sources:
        write_table(folder / "motion" / f"{chunk}.csv", rows)
    # The samples of a shard are in a drawn order, so the echoes of all its motion models are kept
    # until it is written.
    maker.kept = len(rows)

    def content(index: int, level: int) -> tuple[bytes, dict]:
        """Data of one sample, and what its record says of cubes.

        index: its row of the chunk; level: index of its SNR.
        """
        row = rows[index]
        if kind == "recipe":
            echoes, _ = maker.received(row)
            return npy(echoes), {}
        snr_db = levels[level]
        return maker.data(kind, maker.signal(row, snr_db), row, snr_db, cells)

    powers = None
    effects = maker.echo["effects"]
    if kind == "recipe":
        refuse(effects)
        if effects:
            powers = np.concatenate([maker.received(row)[1] for row in rows], axis=1)

    samples = ChunkSamples(
        rows,
        list(levels),
        plan.split,
        plan.seed,
        maker.network,
        dataset.classes,
        powers,
        filters(effects),
    )
    paths = []
    for name in plan.folds(chunk):
        pieces = plan.pieces(chunk, name)
        for number, piece in enumerate(pieces):
            path = folder / "shards" / f"{group}-{name}-{chunk_number}{piece}.tar"
            write_shard(path, samples, name, kind, content, (number, len(pieces)))
            paths.append(path)
    return paths


def main(arguments: list[str]) -> None:
    """Write clouds, motion tables and shards of a merged configuration."""
    line = argparse.ArgumentParser(prog="python -m lowalt.shards.build", description=main.__doc__)
    line.add_argument(
        "--config",
        required=True,
        nargs="+",
        help="merged configuration, or a base and its overlays",
    )
    line.add_argument("--inputs", help="folder of the meshes and recordings that the records name")
    line.add_argument("--clouds", help="folder of finished cloud files (default: clouds are made)")
    line.add_argument("--out", required=True, help="folder to write into")
    options = line.parse_args(arguments)
    config = load(options.config, SCHEMA, unused=("inputs", *OF_TRAINING))
    dataset = Dataset(config, options.clouds, inputs=options.inputs)
    write_run(dataset, options.out, dataset.config["shards"]["kind"])


if __name__ == "__main__":
    run(main)
