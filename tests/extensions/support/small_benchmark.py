"""A small benchmark: the frozen definition with few subtypes, motion models and SNRs, and its data."""

from pathlib import Path

import numpy as np
import yaml

from lowalt.config.layers import overlaid
from lowalt.extensions.benchmark import definition
from lowalt.files.atomic import slug
from lowalt.recognition.views import cache_shard
from lowalt.shards.build import rows_of, write_run
from lowalt.shards.dataset import Dataset
from lowalt.tiles.render import split
from lowalt.tiles.resample import resize

SUBTYPES = [
    "DJI Mini 2",
    "DJI Mini 4 Pro",
    "Crow",
    "Owl",
    "AITO M9 2024",
    "NIO ET5T 2023",
    "Walking Pedestrian 1",
    "Walking Pedestrian 5",
]
LESS = {
    "targets": {"select": SUBTYPES},
    "motion": {"models": 10, "models_per_chunk": 10},
    "noise": {"snr_db": [3, 18]},
}


def shrink(monkeypatch) -> None:
    """Let every part of the definition be small for the rest of a test."""
    small = lambda part: overlaid([*definition.overlays(part), LESS])  # noqa: E731
    for module in ("definition", "part_samples", "frozen_bytes", "confirm"):
        monkeypatch.setattr(f"lowalt.extensions.benchmark.{module}.config_of", small)
    # What is kept of the baselines belongs to all motion models.
    monkeypatch.setattr("lowalt.extensions.benchmark.baselines.path_of", lambda track: Path("none"))
    clear()


def clear() -> None:
    """Forget the samples that have been listed."""
    definition.listed.cache_clear()
    definition.truth.cache_clear()


def resized(data: Dataset, number: int) -> np.ndarray:
    """The images of a sample at 24 pixels, (views, 24, 24)."""
    return resize(split(data.tile(number), 3), 24)


def write(folder: Path, part: str = definition.MAIN) -> Path:
    """Write the data of a part below a folder, as the workflow does; return its run's folder."""
    config = definition.config_of(part)
    run = folder / definition.run_name(part)
    data = Dataset(config)
    index = write_run(data, run, "signal" if config["effects"] else "recipe")
    (run / "config.yaml").write_text(yaml.safe_dump(config))
    for shard in index["shards"]:
        cache_shard(
            run / "shards/index.json",
            shard["name"],
            24,
            run / f"views/24/{Path(shard['path']).stem}.npz",
        )
    (run / "noisy").mkdir()
    for chunk in data.plan.chunks:
        rows = rows_of(data, chunk)
        signals = [[data.maker.signal(row, snr) for snr in data.plan.snrs] for row in rows]
        np.save(run / f"noisy/{slug(chunk)}.npy", np.array(signals))
    return run
