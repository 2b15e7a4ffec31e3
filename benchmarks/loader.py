"""Reading shards: samples per second at training sizes, damage found, resume exact, on a run's own
samples.

    python benchmarks/loader.py --run results/default --out results/benchmarks/loader.csv

Packs one chunk of the run as image shards, as signal shards and as the usual RGB PNG tiles (Pillow,
level 6), then reads each through `torch.utils.data.DataLoader` with two workers, shuffled, at 224,
64 and 24 pixels. RGB tiles are decoded and resized by Pillow. Then reads single samples in random
order from disk, and from a local web server in a process of its own by byte ranges. Then harms
copies of the shards 1 000 times (a byte, or a cut) and stops an epoch 100 times.
"""

import argparse
import io
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import torch
import yaml
from PIL import Image
from torch.utils.data import DataLoader, Dataset

from lowalt.config.network import Network
from lowalt.config.splits import FOLDS
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.machine.hardware import describe
from lowalt.motion import read_table
from lowalt.numerics.streams import stream
from lowalt.recognition.batches import batches, epoch_order
from lowalt.recognition.views import facts_of
from lowalt.shards import ShardSet
from lowalt.shards.index import build
from lowalt.shards.sample_record import npy
from lowalt.shards.sample_table import map_samples, table_path
from lowalt.shards.verify import shard_faults
from lowalt.shards.write import ChunkSamples, write_shard
from lowalt.spectra import Spectra
from lowalt.tiles import Images, Renderer, encode, paint

SERVER = Path(__file__).parent.parent / "tests/support/range_server.py"
COLUMNS = ("what", "kind", "pixels", "workers", "samples", "value", "unit", "hardware")


class Views(Dataset):
    """Index images of a shard set at one size."""

    def __init__(self, shards: ShardSet, size: int) -> None:
        self.shards = shards
        self.size = size

    def __len__(self) -> int:
        return len(self.shards)

    def __getitem__(self, number: int) -> torch.Tensor:
        return torch.from_numpy(self.shards.images(number, size=self.size))


class Colours(Dataset):
    """RGB tiles the usual way: Pillow decodes, cuts and resizes nine images."""

    def __init__(self, files: list[bytes], size: int) -> None:
        self.files = files
        self.size = size

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, number: int) -> torch.Tensor:
        with Image.open(io.BytesIO(self.files[number])) as tile:
            side = tile.width // 3
            boxes = [
                (x, y, x + side, y + side)
                for y in range(0, tile.height, side)
                for x in range(0, tile.width, side)
            ]
            views = [
                tile.crop(box).resize((self.size, self.size), Image.Resampling.BILINEAR)
                for box in boxes
            ]
        return torch.from_numpy(np.stack([np.asarray(view) for view in views]))


def pack(run: Path, folder: Path, models: int) -> dict[str, Path]:
    """Index files of image and signal shards of the first rows of every chunk; the same samples in
    both.
    """
    config = yaml.safe_load((run / "config.yaml").read_text())
    network = Network.from_settings(config["network"])
    images = Images.from_settings(config["images"])
    tiles = Renderer(network, Spectra.from_settings(config["spectra"]), images)
    render = {name: config[name] for name in ("network", "spectra", "images")}
    snrs = [float(snr) for snr in config["noise"]["snr_db"]]
    indexes = {}
    for kind in ("image", "signal"):
        shards = []
        for source in sorted((run / "noisy").glob("*-00000.npy")):
            rows = read_table(run / "motion" / f"{source.stem}.csv")[:models]
            signals = np.load(source, mmap_mode="r")
            png = lambda n, level, s=signals: (encode(tiles.tile(s[n, level]), images.palette), {})  # noqa: E731
            raw = lambda n, level, s=signals: (npy(s[n, level]), {})  # noqa: E731
            for fold in FOLDS:
                group, part = source.stem.split("-")
                shards.append(folder / kind / f"{group}-{fold}-{part}.tar")
                content = png if kind == "image" else raw
                chunk = ChunkSamples(rows, snrs, config["split"], config["seed"], network)
                write_shard(shards[-1], chunk, fold, kind, content)
        indexes[kind] = folder / kind / "index.json"
        build(shards, render, indexes[kind])
    return indexes


def rate(data: Dataset, workers: int, batch: int = 16) -> float:
    """Samples a second through a shuffled loader, the best of five epochs, once every worker has
    begun.
    """
    best = 0.0
    # Read one sample first: the workers inherit everything that it compiles or opens.
    data[0]
    for epoch in range(5):
        order = stream(1, "loader", epoch).permutation(len(data))
        loader = DataLoader(data, batch_sampler=batches(order, batch), num_workers=workers)
        found = iter(loader)
        for _ in range(2 * workers):
            next(found)
        start = time.perf_counter()
        count = 0
        for views in found:
            count += len(views)
        best = max(best, count / (time.perf_counter() - start))
    return best


def processor_ms(data: Dataset, samples: int = 60) -> float:
    """Processor time of one sample in this process (ms): the least of three passes, averaged over
    samples.
    """
    data[0]
    passes = []
    for _ in range(3):
        times = []
        for number in range(min(samples, len(data))):
            start = time.process_time()
            data[number]
            times.append(time.process_time() - start)
        passes.append(times)
    return 1e3 * float(np.min(passes, axis=0).mean())


def access_ms(index: str | Path, rng: np.random.Generator, count: int = 300) -> float:
    """Median time until the record and data of a random sample are read and checked (ms), once its
    table is there.
    """
    shards = ShardSet(index)
    times = []
    if not len(shards.keys):
        raise InputError(f"{index}: no samples")
    for number in rng.integers(len(shards), size=count):
        shards.keys[number]
        start = time.perf_counter()
        shards.members(number)
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times))


def served_ms(index: Path, rng: np.random.Generator) -> float:
    """`access_ms` over HTTP, from a server on this machine."""
    command = [sys.executable, str(SERVER), str(index.parent)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        address = server.stdout.readline().strip()
        try:
            return access_ms(f"{address}/{index.name}", rng)
        finally:
            server.terminate()


def damage(
    index: Path, folder: Path, count: int, rng: np.random.Generator
) -> tuple[int, int, int, int]:
    """Harm shards `count` times: faults, those that verify found, named with the sample, and that
    reading refused.
    """
    shutil.copytree(index.parent, folder)
    index = folder / index.name
    entries = json.loads(index.read_text())["shards"]
    found = named = refused = 0
    for _ in range(count):
        entry = entries[rng.integers(len(entries))]
        path = folder / entry["path"]
        place = int(rng.integers(entry["bytes"]))
        cut = rng.random() < 0.5
        with path.open("r+b") as file:
            file.seek(place)
            rest = file.read() if cut else file.read(1)
            file.seek(place)
            if cut:
                file.truncate()
            else:
                file.write(bytes([rest[0] ^ int(rng.integers(1, 256))]))
        rows = map_samples(table_path(path))
        hit = [
            n for n, row in enumerate(rows) if row["offset"] <= place < row["offset"] + row["size"]
        ]
        keys = [rows["key"][n].decode() for n in hit] or ["end of the archive", "bytes, expected"]
        lines = list(shard_faults(path, entry))
        found += bool(lines)
        named += any(entry["name"] in line and key in line for line in lines for key in keys)
        refused += refuses(index, entry, hit)
        with path.open("r+b") as file:
            file.seek(place)
            file.write(rest)
    return count, found, named, refused


def refuses(index: Path, entry: dict, hit: list[int]) -> bool:
    """Whether reading the harmed sample raises; harm outside all samples has none to read."""
    if not hit:
        return True
    shards = ShardSet(index, [entry["group"]], [entry["fold"]])
    start = sum(
        e["samples"]
        for e in shards.shards[: [e["name"] for e in shards.shards].index(entry["name"])]
    )
    try:
        shards.images(start + hit[0])
    except InputError as error:
        return entry["name"] in str(error)
    return False


class Keys(Dataset):
    """The key that each sample's own record, read from its shard, gives it."""

    def __init__(self, shards: ShardSet) -> None:
        self.shards = shards

    def __getitem__(self, number: int) -> str:
        return self.shards.record(number)["key"]


def resumes(shards: ShardSet, count: int, rng: np.random.Generator) -> int:
    """How many of `count` stops and resumes read the very samples, in the very order, of the
    uninterrupted epoch.
    """
    data = Keys(shards)
    facts = facts_of(shards, np.arange(len(shards)), placed=False)
    parts = [batches(epoch_order(facts, 5, ("resumes",), 1, 0), 8) for _ in range(2)]
    order = list(DataLoader(data, batch_sampler=parts[0]))
    keys = [key for batch in order for key in batch]
    if len(set(keys)) != len(keys) or len(keys) < len(shards) - 7:
        return 0
    stops = rng.integers(0, len(order) + 1, count)
    rests = (list(DataLoader(data, batch_sampler=parts[1][int(stop) :])) for stop in stops)
    return sum(order[:stop] + rest == order for stop, rest in zip(stops, rests, strict=True))


def main() -> None:
    """Measure and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "--run", type=Path, required=True, help="a run's folder: config.yaml, motion/ and noisy/"
    )
    options.add_argument(
        "--models", type=int, default=60, help="motion models of each group to pack"
    )
    options.add_argument("--faults", type=int, default=1000)
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    torch.set_num_threads(1)
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        indexes = pack(given.run, folder, given.models)
        sets = {kind: ShardSet(index) for kind, index in indexes.items()}
        numbers = range(min(len(sets["image"]), 240))
        colours = []
        for number in numbers:
            buffer = io.BytesIO()
            Image.fromarray(paint(sets["image"].tile(number), sets["image"].palette)).save(
                buffer, "PNG"
            )
            colours.append(buffer.getvalue())
        for size in (224, 64, 24):
            sources = {kind: Views(shards, size) for kind, shards in sets.items()} | {
                "RGB PNG": Colours(colours, size)
            }
            for kind, data in sources.items():
                rows.append(("loading", kind, size, 2, len(data), rate(data, 2), "samples/s"))
                rows.append(
                    ("one sample", kind, size, 0, len(data), processor_ms(data), "ms of processor")
                )
        rng = np.random.default_rng(0)
        for kind, index in indexes.items():
            rows.append(("random access, disk", kind, "", 0, 300, access_ms(index, rng), "ms"))
            rows.append(("random access, HTTP", kind, "", 0, 300, served_ms(index, rng), "ms"))
        for kind, index in indexes.items():
            count, found, named, refused = damage(
                index, folder / f"harmed-{kind}", given.faults, rng
            )
            for what, number in (
                ("found", found),
                ("named", named),
                ("refused by the loader", refused),
            ):
                rows.append((f"faults {what}", kind, "", "", count, number, f"of {count}"))
        rows.append(
            (
                "resumed exactly",
                "signal",
                "",
                "",
                len(sets["signal"]),
                resumes(sets["signal"], 100, rng),
                "of 100",
            )
        )
        for kind, shards in sets.items():
            size = sum(entry["bytes"] for entry in shards.shards) / len(shards)
            rows.append(("bytes on disk", kind, "", "", len(shards), size, "bytes/sample"))
    table = [
        [f"{value:.5g}" if isinstance(value, float) else value for value in row] for row in rows
    ]
    for line in table:
        print(*line, sep="  ")
    write_csv(given.out, COLUMNS, [[*line, describe()] for line in table])


if __name__ == "__main__":
    main()
