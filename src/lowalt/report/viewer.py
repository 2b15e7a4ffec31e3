"""The samples in the viewer of a page.

They come with their tiles and axes, echoes, probabilities, motion and truth. The report of a run
and the site of documents share one template with its script and its colours (`viewer.html`);
`shown` returns all that it needs. All is small: motion is kept at FRAMES instants of one cycle.
"""

import base64
import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.ticker import MaxNLocator

from lowalt.config.network import Network
from lowalt.files.atomic import text_file
from lowalt.motion import positions
from lowalt.recognition import predictions
from lowalt.recognition.distances import cycle_s, still_row
from lowalt.report.figures.style import embedded
from lowalt.report.figures.tile_axes import axes_of
from lowalt.report.viewer_echoes import FLOOR_DB, echoes
from lowalt.report.viewer_truth import colours, truth
from lowalt.shards import ShardSet
from lowalt.shards.sample_list import slug_of
from lowalt.shards.sample_record import row_of
from lowalt.spectra import spectrum
from lowalt.targets.cloud import Cloud
from lowalt.tiles import resize
from lowalt.tiles.png import encode
from lowalt.tiles.render import Renderer, join, split

PIXELS = 80
"""Pixels per side of an image in the report of a run."""
MODELS = 2
"""Number of motion models of a subtype."""
SNRS = 3
"""Number of SNRs of a motion model: the lowest, the highest, and those between them."""
BUDGET = 3_500_000
"""Limit for the bytes of all tiles as the page holds them; samples beyond it are left out."""
FRAMES = 24
"""Number of instants of one cycle of a target's motion."""
POINTS = 160
"""Largest number of points of a cloud that are drawn."""
LARGEST_INT16 = 32767
TIME = "time (s)"
WITHOUT = "none"
"""Word for the absence of an effect."""


class ViewedSample(NamedTuple):
    """A sample of the viewer.

    effect: what the scene adds, in one word; record: as in the shards; tile: (rows, columns) uint8
    index values; signal: (stations, symbols) complex, None where it cannot be made again.
    """

    effect: str
    record: dict
    tile: np.ndarray
    signal: np.ndarray | None


def chosen(shards: ShardSet, predicted: set[str], unseen: set[str]) -> list[int]:
    """Return numbers of samples: of each class a seen and an unseen subtype.

    Each subtype has MODELS models and each model SNRS SNRs. predicted: keys of samples with
    predictions, which go before others; unseen: slugs of subtypes held out. The order is by rounds,
    a sample of every subtype in each, so that leaving out the last ones leaves out no subtype.
    """
    keys = [key.decode() for key in shards.keys.tolist()]
    models = shards.models.tolist()
    groups: dict[tuple, dict[str, list[int]]] = {}
    for number, (key, label) in enumerate(zip(keys, shards.labels.tolist(), strict=True)):
        name = slug_of(key)
        subtypes = groups.setdefault((label, name in unseen), {})
        subtypes.setdefault(name, []).append(number)
    picks: list[tuple[int, int]] = []
    for _, subtypes in sorted(groups.items()):
        # The first subtype with predictions, or the first one where none has any.
        with_predictions = []
        for name, numbers in subtypes.items():
            if any(keys[number] in predicted for number in numbers):
                with_predictions.append(name)
        chosen_subtype = min(with_predictions or subtypes)
        of_model: dict[tuple, list[int]] = {}
        for number in subtypes[chosen_subtype]:
            model = (keys[number] not in predicted, models[number])
            of_model.setdefault(model, []).append(number)
        for order, (_, numbers) in enumerate(sorted(of_model.items())[:MODELS]):
            by_snr = sorted(numbers, key=lambda number: shards.snrs_db[number])
            # The clearest, the noisiest, then the one between them; once each if they coincide.
            levels = dict.fromkeys([len(by_snr) - 1, 0, len(by_snr) // 2][:SNRS])
            for step, level in enumerate(levels):
                picks.append((step * MODELS + order, by_snr[level]))
    return [number for _, number in sorted(picks, key=lambda pick: pick[0])]


def predicted_keys(paths: Iterable[str | Path]) -> set[str]:
    """Return the keys of all samples in prediction files."""
    keys: set[str] = set()
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
    first: dict[Path, Path] = {}
    of_samples: dict[str, dict] = {}
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


def motion(cloud: Cloud, row: dict, network: Network) -> dict:
    """Return one cycle of a target's own motion, and the truth of its motion in the look.

    `points` are int16 in base64, of which 32767 is `scale_m`; `colours` of the points; `truth`: a
    picture per station (`lowalt.report.viewer_truth`).
    """
    moves = len(cloud.track) or row["rate_hz"] > 0
    seconds = 1.0  # any span will do for a target that does not move
    if moves:
        seconds = cycle_s(cloud, row)
    points = positions(cloud, still_row(row), np.arange(FRAMES) / FRAMES * seconds)
    some = np.unique(np.linspace(0, points.shape[1] - 1, POINTS).round().astype(int))
    points = points[:, some]
    points = points - (points.min(axis=(0, 1)) + points.max(axis=(0, 1))) / 2
    scale = max(float(abs(points).max()), 1e-9)
    coordinates = (points / scale * LARGEST_INT16).round().astype("<i2")
    data = base64.b64encode(coordinates.tobytes()).decode()
    of_parts = ["#{:02x}{:02x}{:02x}".format(*colour) for colour in colours(cloud)]
    return {
        "seconds": seconds,
        "count": len(some),
        "frames": FRAMES,
        "scale_m": scale,
        "colours": [of_parts[part] for part in cloud.part[some]],
        "points": data,
        "truth": truth(cloud, row, network, some),
    }


def _ticks(low: float, high: float) -> list[float]:
    """Return up to five round numbers from `low` to `high`."""
    values = MaxNLocator(4).tick_values(low, high)
    return [float(f"{value:g}") for value in values if low <= value <= high]


def _panel(
    station: str, title: str, across: tuple[str, float, float], upwards: tuple[str, float, float]
) -> dict:
    """A panel's title and axes: name, lowest and highest value of each, and ticks."""
    _, left, right = across
    _, first, last = upwards
    low, high = sorted((first, last))
    return {
        "station": station,
        "title": title,
        "low": low,
        "high": high,
        "left": left,
        "right": right,
        "across": across[0],
        "timed": across[0] == TIME,
        "upwards": upwards[0].partition("\n")[0],
        "x": _ticks(left, right),
        "y": _ticks(low, high),
    }


def panels(renderer: Renderer) -> list[dict]:
    """Return what the images of a tile show, station by station: names, axes, ticks."""
    entries = []
    for row, station in enumerate(renderer.network.stations):
        for column, name in enumerate(renderer.spectra):
            axes = axes_of(name, station, renderer)
            _, first, last = axes.upwards
            place = {"row": row, "column": column, "turned": first > last}
            entries.append(place | _panel(station.name, spectrum(name).TITLE, *axes))
    return entries


def truth_panels(network: Network) -> list[dict]:
    """Return the axes of each station's truth: the whole look, and speeds up to the largest."""
    entries = []
    for row, station in enumerate(network.stations):
        folds = network.largest_mps(station)
        across = TIME, 0.0, network.symbols * network.symbol_interval_s
        upwards = "radial speed (m/s)", -folds, folds
        place = {"row": row, "folds": folds}
        entries.append(place | _panel(station.name, "truth", across, upwards))
    return entries


def reduced(tile: np.ndarray, spectra: int, pixels: int, palette: np.ndarray) -> str:
    """Return a tile (rows, columns) uint8 as an embedded PNG.

    Images of more than `pixels` a side are reduced to it.
    """
    images = split(tile, spectra)
    if images.shape[-1] > pixels:
        images = resize(images, pixels)
    return embedded(encode(join(images, spectra), palette))


def _entry(
    one: ViewedSample, network: Network, tiles: tuple[str, str], group: str, shares: dict
) -> dict:
    """The page's entry of a sample; tiles: its embedded pictures for readers and of the networks."""
    record = one.record
    heard = []
    if one.signal is not None:
        heard = echoes(one.signal, record["geometry"], network)
    snr = "no noise"
    if record["noise"]:
        snr = f"{record['snr_db']:g} dB"
    tile, of_networks = tiles
    return {
        "subtype": record["subtype"],
        "category": record["category"],
        "model": record["model"],
        "group": group,
        "effect": one.effect,
        "snr": snr,
        "tile": tile,
        "network": of_networks,
        "echoes": heard,
        "probabilities": shares,
    }


def shown(
    viewed: Iterable[ViewedSample],
    renderer: Renderer,
    clouds: Mapping[str, Cloud],
    groups: dict[str, str],
    classes: tuple[str, ...],
    shares: dict[str, dict],
    sides: tuple[int, int],
) -> dict:
    """Return the values of the viewer's template.

    viewed: the samples, the most important first, of which as many are taken as BUDGET allows;
    clouds: by subtype; groups: "seen" or "unseen" by subtype; shares: as `probabilities` returns
    them; sides: pixels per side of an image on the page, and of one as the networks see it.
    """
    network = renderer.network
    spectra = len(renderer.spectra)
    palette = renderer.images.palette
    side, network_side = sides
    motions: dict[str, dict] = {}
    total = 0
    kept: list[tuple[float, dict]] = []
    for one in viewed:
        record = one.record
        tile = reduced(one.tile, spectra, side, palette)
        total += len(tile)
        if kept and total > BUDGET:
            break
        subtype = record["subtype"]
        name = f"{subtype} {record['model']}"
        moves = record["motion"].get("x_m") is not None
        if name not in motions and subtype in clouds and moves:
            motions[name] = motion(clouds[subtype], row_of(record)[0], network)
        tiles = tile, reduced(one.tile, spectra, network_side, palette)
        shares_of_one = shares.get(record["key"], {})
        entry = _entry(one, network, tiles, groups.get(subtype, ""), shares_of_one)
        kept.append((record["snr_db"], entry))
    # The clearest sample of a motion model first, as the page lists them.
    clearest = [entry for _, entry in sorted(kept, key=lambda pair: -pair[0])]
    stations = [station.name for station in network.stations]
    look_s = network.symbols * network.symbol_interval_s
    data = {
        "samples": clearest,
        "motions": motions,
        "classes": list(classes),
        "stations": stations,
        "look_s": look_s,
        "step_s": network.symbol_interval_s,
    }
    return {
        "data": data,
        "panels": panels(renderer),
        "truths": truth_panels(network),
        "size": renderer.images.size,
        "shown": min(renderer.images.size, side),
        "rows": len(stations),
        "columns": spectra,
        "pixels": network_side,
        "stations": stations,
        "floor_db": FLOOR_DB,
        "look_s": look_s,
    }
