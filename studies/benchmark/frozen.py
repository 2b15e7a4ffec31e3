"""A frozen backbone with ImageNet's weights: its features of the images, for a linear classifier
(`classical.py`).

The three images of a station stand side by side and are enlarged, so that the backbone, which
halves its images five times, still tells rows and columns apart.
Source: Kornblith, Shlens and Le, Do Better ImageNet Models Transfer Better?, CVPR 2019.
"""

import json
import time
from pathlib import Path

import numpy as np
import torch
from imagenet_weights import BACKBONE, write_weights
from torch import nn

from lowalt.extensions.benchmark.definition import MAIN, config_of
from lowalt.extensions.benchmark.part_samples import VIEWS, TrackSamples
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.recognition.recogniser import Palettes, backbone
from lowalt.recognition.samples import ViewSamples
from lowalt.recognition.schemes import Scheme
from lowalt.tiles import colour_map

STATIONS = (0, 1, 2)
SCALE = 3
"""How much larger the backbone sees the images."""
BATCH = 64


def embedded(images: np.ndarray, model: nn.Module, colours: str) -> np.ndarray:
    """Return features (samples, stations, F) float16 of index images (samples, stations * 3, S, S)
    uint8.

    model: a backbone of timm without classifier; colours: name of the colour map.
    """
    pre, (samples, columns, size) = model.pretrained_cfg, images.shape[:3]
    palettes = Palettes(np.stack([colour_map(colours)]), (0,), pre["mean"], pre["std"])
    stations = columns // len(VIEWS)
    rows = images.reshape(samples, stations, len(VIEWS), size, size).swapaxes(2, 3)
    rows = rows.reshape(samples * stations, size, len(VIEWS) * size)
    found = []
    with torch.inference_mode():
        for start in range(0, len(rows), BATCH):
            batch = palettes(torch.from_numpy(rows[start : start + BATCH])[:, None, None])[:, 0, 0]
            larger = nn.functional.interpolate(batch, scale_factor=SCALE, mode="bilinear")
            found.append(model(larger.contiguous(memory_format=torch.channels_last)))
    return torch.cat(found).view(samples, stations, -1).numpy().astype(np.float16)


def embedded_chunk(path: Path, folder: Path) -> Path:
    """Return the file of the keys (n,) and features (n, stations, F) of a file of images; made
    once, then kept.

    path: a file of a run's index images; folder: where features and weights are kept.
    """
    kept = folder / embedded.__name__ / path.parents[2].name / path.name
    if not kept.is_file():
        torch.set_num_threads(1)
        group, fold = path.stem.split("-")[:2]
        begun = time.process_time()
        samples = ViewSamples(
            [path], Scheme("all spectra", STATIONS, VIEWS).columns, {(group, fold)}
        )
        model = backbone(
            BACKBONE, str(write_weights(folder / f"{BACKBONE}.pth")), SCALE * samples.size
        ).eval()
        found = embedded(samples.images, model, config_of(MAIN)["images"]["colour_map"])
        with replacing(kept) as temporary, temporary.open("wb") as file:
            np.savez(file, key=samples.facts.key, features=found)
        seconds = (time.process_time() - begun) / len(found)
        with replacing(kept.with_suffix(".json")) as temporary:
            temporary.write_text(json.dumps({"core_s_per_sample": seconds}) + "\n")
    return kept


def embedded_of(samples: TrackSamples, folder: Path) -> np.ndarray:
    """Return the features (samples, stations * F) float32 of a track's part, station by station."""
    wanted = {key: number for number, key in enumerate(samples.key.tolist())}
    result: np.ndarray | None = None
    pairs = set(zip(samples.facts.group.tolist(), samples.facts.fold.tolist(), strict=True))
    for path in sorted((samples.run / f"views/{samples.size}").glob("*.npz")):
        if tuple(path.stem.split("-")[:2]) not in pairs:
            continue
        with np.load(embedded_chunk(path, folder)) as data:
            keys = data["key"]
            features = data["features"]
        if result is None:
            result = np.empty(
                (len(samples), len(samples.track.stations), features.shape[-1]), np.float32
            )
        places = [(wanted.pop(key), row) for row, key in enumerate(keys.tolist()) if key in wanted]
        if places:
            numbers, rows = map(list, zip(*places, strict=True))
            result[numbers] = features[rows][:, list(samples.track.stations)]
    if wanted or result is None:
        raise InputError(
            f"{samples.run}/views: no image of {next(iter(wanted))}, expected one of every sample"
        )
    return result.reshape(len(samples), -1)
