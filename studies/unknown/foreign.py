"""Windows that no class fits: noise alone, land without a target, and targets of other kinds."""

from dataclasses import replace
from pathlib import Path

import numpy as np

import trainings
from lowalt import Dataset
from lowalt.noise.awgn import noisy_signals
from lowalt.numerics.streams import stream
from lowalt.recognition import samples
from lowalt.recognition.dataset_samples import DatasetSamples
from lowalt.recognition.samples import Facts
from lowalt.recognition.schemes import Scheme, columns_in
from lowalt.shards.maker import Maker
from lowalt.tiles.resample import resize

HERE = Path(__file__).parent
NOISE = {"train": 400, "val": 50, "test": 1000}
"""Windows of noise alone of each fold."""
FAINT = 1e-12
"""Factor on a target's cross section that leaves nothing of its echo."""
EVERY = {(group, fold) for group in ("seen", "unseen") for fold in ("train", "val", "test")}


def facts(names: list[str], models: np.ndarray, snr_db: np.ndarray, folds: list[str], stations: int) -> Facts:
    """Return the facts of windows without a target: names of what was there, and their numbers (n,)."""
    count = len(names)
    keys = [f"{name}-{model:06d}-{snr:g}" for name, model, snr in zip(names, models, snr_db, strict=True)]
    unknown = np.full((count, stations), np.nan)
    return Facts(
        key=np.array(keys), subtype=np.array(names), model=models, snr_db=snr_db, group=np.full(count, "seen"),
        fold=np.array(folds), label=np.full(count, 0), range_m=unknown, aspect_rad=unknown,
    )  # fmt: skip


def _seen(maker: Maker, signal: np.ndarray, scheme: Scheme, size: int) -> np.ndarray:
    """Index images (views, size, size) uint8 of the scheme's views of signals (stations, symbols)."""
    columns = columns_in(scheme.columns, list(maker.renderer.spectra), len(signal), scheme.name)
    return resize(maker.renderer.some(signal, columns, None, None), size)


def noise(config: dict, scheme: Scheme, size: int) -> tuple[np.ndarray, Facts]:
    """Return the images (n, views, size, size) uint8 of white noise alone, and their facts."""
    maker = Dataset(config, clouds={}).maker
    shape, folds = (len(maker.network.stations), maker.network.symbols), np.repeat(list(NOISE), list(NOISE.values()))
    images = np.empty((len(folds), len(scheme.columns), size, size), np.uint8)
    for number in range(len(folds)):
        drawn = stream(config["seed"], "unknown", "noise", number).standard_normal((2, *shape))
        images[number] = _seen(maker, (drawn[0] + 1j * drawn[1]).astype(np.complex64), scheme, size)
    count = np.arange(len(folds))
    return images, facts(["noise"] * len(folds), count, np.full(len(folds), -np.inf), folds.tolist(), shape[0])


def land(config: dict, scheme: Scheme, size: int) -> tuple[np.ndarray, Facts]:
    """Return the images (n, views, size, size) uint8 of a scene whose target was taken away, and their facts.

    The noise is as strong as beside the target: each SNR refers to its echo. One motion model of each subtype and SNR.
    """
    dataset = Dataset(config)
    maker, levels = dataset.maker, dataset.plan.snrs
    faint = {name: replace(cloud, rcs_m2=FAINT * cloud.rcs_m2) for name, cloud in dataset.clouds.items()}
    empty = Maker(maker.render, maker.echo, maker.seed, faint)
    stations = [station.name for station in maker.network.stations]
    images, numbers, snrs = [], [], []
    for number in range(len(dataset)):
        place = dataset.place(number)
        if place.model != levels.index(place.snr_db):
            continue
        row = dataset.row(place)
        powers, (clean, _) = maker.received(row)[1], empty.received(row)
        signal = noisy_signals(clean[:, None], [row], stations, [place.snr_db], maker.seed, powers)[0, 0]
        images.append(_seen(maker, signal, scheme, size))
        numbers.append(number)
        snrs.append(place.snr_db)
    count = len(images)
    told = facts(["land"] * count, np.array(numbers), np.array(snrs, float), ["test"] * count, len(stations))
    return np.stack(images), told


def others(config: dict, scheme: Scheme, size: int) -> tuple[np.ndarray, Facts]:
    """Return the images (n, views, size, size) uint8 of all targets of a configuration, and their facts."""
    found = DatasetSamples(Dataset(config), scheme.columns, EVERY, size, placed=False)
    return found.views(np.arange(len(found.facts))), found.facts


MAKERS = {"noise": (noise, "config.yaml"), "land": (land, "land.yaml"), "others": (others, "others.yaml")}


def cached(name: str, scheme: Scheme, size: int, folder: Path) -> Path:
    """Return the cache of views of `name`, one of MAKERS, which is made where it is not there."""
    path = folder / f"{name}-{size}.npz"
    if not path.is_file():
        make, overlay = MAKERS[name]
        images, told = make(trainings.config_of(HERE / overlay), scheme, size)
        samples.write(path, images, told)
    return path
