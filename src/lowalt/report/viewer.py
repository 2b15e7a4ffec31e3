"""The samples in the viewer of the page: their choice, tiles with axes, echoes, probabilities and
motion.

All are small: tiles are reduced to PIXELS a side, motion is kept as millimetres at FRAMES instants
of one cycle.
"""

import base64
import csv
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from matplotlib.ticker import MaxNLocator

from lowalt.files.atomic import slug, text_file
from lowalt.motion import positions
from lowalt.recognition import predictions
from lowalt.recognition.distances import cycle_s, still_row
from lowalt.report.figures.style import embedded
from lowalt.report.figures.tile_axes import axes_of
from lowalt.report.viewer_echoes import echoes
from lowalt.shards import ShardSet
from lowalt.shards.remake import Remaker
from lowalt.shards.sample_record import row_of
from lowalt.spectra import spectrum
from lowalt.targets.cloud import Cloud
from lowalt.tiles import resize
from lowalt.tiles.png import encode
from lowalt.tiles.render import Renderer, join, split

PIXELS = 80
MODELS = 2
"""Number of motion models of a subtype."""
SNRS = 3
"""Number of SNRs of a motion model: the lowest, the highest, and those between them."""
BUDGET = 3_500_000
"""Limit for the bytes of all tiles as the page holds them; samples beyond it are left out."""
FRAMES = 24
POINTS = 160
KEY = re.compile(r"(.+)-(\d{6,})-snr.+")


def chosen(shards: ShardSet, predicted: set[str], unseen: set[str]) -> list[int]:
    """Return numbers of samples: of each class a seen and an unseen subtype.

    Each subtype has MODELS models and each model SNRS SNRs. predicted: keys of samples with
    predictions, which go before others; unseen: slugs of subtypes held out. The order is by rounds,
    a sample of every subtype in each, so that leaving out the last ones leaves out no subtype.
    """
    keys = [key.decode() for key in shards.keys.tolist()]
    models: dict[tuple, dict[str, list[int]]] = {}
    for number, (key, label) in enumerate(zip(keys, shards.labels.tolist(), strict=True)):
        name = KEY.fullmatch(key)[1]
        group = models.setdefault((label, name in unseen), {})
        group.setdefault(name, []).append(number)
    picks: list[tuple[int, int]] = []
    for _, subtypes in sorted(models.items()):
        # The first subtype with predictions, or the first one where none has any.
        shown = min(
            subtypes, key=lambda name: (predicted.isdisjoint(keys[n] for n in subtypes[name]), name)
        )
        of_model: dict[tuple, list[int]] = {}
        for number in subtypes[shown]:
            model = int(KEY.fullmatch(keys[number])[2])
            of_model.setdefault((keys[number] not in predicted, model), []).append(number)
        for order, (_, numbers) in enumerate(sorted(of_model.items())[:MODELS]):
            levels = sorted(numbers, key=lambda number: shards.snrs_db[number])
            # The clearest, the noisiest, then the one between them.
            steps_shown = dict.fromkeys([len(levels) - 1, 0, len(levels) // 2][:SNRS])
            for step, level in enumerate(steps_shown):
                picks.append((step * MODELS + order, levels[level]))
    return [number for _, number in sorted(picks, key=lambda pick: pick[0])]


def predicted_keys(paths: Iterable[str | Path]) -> set[str]:
    """Return the keys of all samples in prediction files."""
    keys = set()
    for path in paths:
        with text_file(path, "predictions") as file:
            keys.update(row[0] for row in csv.reader(file))
    return keys


def probabilities(
    paths: Iterable[str | Path], keys: set[str], classes: tuple[str, ...]
) -> dict[str, dict]:
    """Return class probabilities as key -> "protocol scheme" -> list.

    They are those of the first file per protocol and scheme.
    """
    columns = predictions.probability_columns(classes)
    first = {}
    of_samples = {}
    for path in paths:
        first.setdefault(Path(path).parent, Path(path))
    for path in first.values():
        about = predictions.record(path)
        name = f"{about['protocol']} {about['scheme']}"
        with text_file(path, "predictions") as file:
            for row in csv.DictReader(file):
                if row["key"] in keys:
                    shares = [round(float(row[column]), 4) for column in columns]
                    of_samples.setdefault(row["key"], {})[name] = shares
    return of_samples


def motion(cloud: Cloud, row: dict) -> dict:
    """Return one cycle of a target's own motion for the page.

    `points` are int16 in base64, of which 32767 is `scale_m`.
    """
    moves = len(cloud.track) or row["rate_hz"] > 0
    seconds = cycle_s(cloud, row) if moves else 1.0
    points = positions(cloud, still_row(row), np.arange(FRAMES) / FRAMES * seconds)
    some = np.unique(np.linspace(0, points.shape[1] - 1, POINTS).round().astype(int))
    points = points[:, some]
    points = points - (points.min(axis=(0, 1)) + points.max(axis=(0, 1))) / 2
    scale = max(float(abs(points).max()), 1e-9)
    data = base64.b64encode((points / scale * 32767).round().astype("<i2").tobytes()).decode()
    part = cloud.part[some].tolist() if len(cloud.part) == len(cloud.points) else [0] * len(some)
    return {
        "seconds": seconds,
        "count": len(some),
        "frames": FRAMES,
        "scale_m": scale,
        "part": part,
        "points": data,
    }


def _ticks(low: float, high: float) -> list[float]:
    """Return up to five round numbers from `low` to `high`."""
    values = MaxNLocator(4).tick_values(low, high)
    return [float(f"{value:g}") for value in values if low <= value <= high]


def panels(renderer: Renderer) -> list[dict]:
    """Return what the images of a tile show, station by station: names, axes, ticks."""
    entries = []
    for row, station in enumerate(renderer.network.stations):
        for column, name in enumerate(renderer.spectra):
            axes = axes_of(name, station, renderer)
            low, high = sorted(axes.upwards[1:])
            (across, left, right), (upwards, first, last) = axes
            folds = renderer.network.largest_mps(station)
            entries.append(
                {
                    "row": row,
                    "column": column,
                    "station": station.name,
                    "title": spectrum(name).TITLE,
                    "low": low,
                    "high": high,
                    "left": left,
                    "right": right,
                    "across": across,
                    "upwards": upwards.partition("\n")[0],
                    "turned": first > last,
                    "folds": folds,
                    "x": _ticks(left, right),
                    "y": _ticks(low, high),
                }
            )
    return entries


def reduced(tile: np.ndarray, spectra: int, pixels: int, palette: np.ndarray) -> str:
    """Return a tile (rows, columns) uint8 as an embedded PNG whose images have at most `pixels` a
    side.
    """
    images = split(tile, spectra)
    images = resize(images, pixels) if images.shape[-1] > pixels else images
    return embedded(encode(join(images, spectra), palette))


def samples(
    shards: ShardSet,
    remaker: Remaker | None,
    clouds: dict[str, Cloud],
    files: list[str],
    groups: dict[str, str],
    pixels: int,
) -> dict:
    """Return the viewer's samples: {"samples": [...], "motions": {...}}.

    remaker: makes signals again, None for a data set that does not say how; clouds: by subtype;
    files: prediction files; groups: "seen" or "unseen" by subtype; pixels: side of an image as the
    networks see it.
    """
    unseen = {slug(name) for name, group in groups.items() if group == "unseen"}
    numbers = chosen(shards, predicted_keys(files), unseen)
    keys = {shards.keys[number].decode() for number in numbers}
    shares = probabilities(files, keys, shards.classes)
    names = [station.name for station in shards.renderer.network.stations]
    spectra = len(shards.spectra)
    motions = {}
    total = 0
    kept: list[tuple[float, dict]] = []
    for number in numbers:
        whole = shards.tile(number)
        record = shards.record(number)
        tile = reduced(whole, spectra, PIXELS, shards.palette)
        total += len(tile)
        if kept and total > BUDGET:
            break
        subtype = record["subtype"]
        name = f"{subtype} {record['model']}"
        moves = record["motion"].get("x_m") is not None
        if name not in motions and subtype in clouds and moves:
            motions[name] = motion(clouds[subtype], row_of(record)[0])
        heard = []
        if remaker:
            heard = echoes(remaker.signal(record), record["geometry"], remaker.network)
        sample = {
            "subtype": subtype,
            "category": record["category"],
            "model": record["model"],
            "group": groups.get(subtype, ""),
            "snr": f"{record['snr_db']:g} dB" if record["noise"] else "no noise",
            "tile": tile,
            "network": reduced(whole, spectra, pixels, shards.palette),
            "echoes": heard,
            "probabilities": shares.get(record["key"], {}),
        }
        kept.append((record["snr_db"], sample))
    # The clearest sample of a motion model first, as the page lists them.
    clearest = [sample for _, sample in sorted(kept, key=lambda pair: -pair[0])]
    return {
        "samples": clearest,
        "motions": motions,
        "classes": list(shards.classes),
        "stations": names,
    }
