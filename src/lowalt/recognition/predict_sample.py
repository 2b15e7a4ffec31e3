"""One sample from a file, its signals or its tile, and what a trained model says of it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch

from lowalt.files.array_files import array_of
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.recognition.runs import Trained
from lowalt.recognition.schemes import columns_in
from lowalt.spectra.catalogue import named
from lowalt.tiles import Renderer, decode, resize, split


def images_of(path: Path, settings: dict) -> np.ndarray:
    """Return all index images (stations spectra, S, S) uint8 of a signal file or a tile.

    path: .npy, complex (stations, symbols), or .png, an indexed tile; settings: {network, spectra,
    images}.
    Raises: InputError naming the file, for another kind of file or a shape that does not fit.
    """
    if path.suffix == ".png":
        tile, _ = _named(path, decode, existing(path, "tile").read_bytes())
    else:
        tile = _named(path, Renderer.from_settings(settings).tile, _signals(path))
    return _named(path, split, tile, len(named(settings["spectra"])))


def _named(path: Path, call: Callable[..., Any], *arguments: object) -> Any:
    """Return call(*arguments); a refusal of it gets the file's name in front."""
    try:
        return call(*arguments)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _signals(path: Path) -> np.ndarray:
    """Return the complex array of a signal file.

    Raises: InputError naming the file, for another kind of file.
    """
    if path.suffix != ".npy":
        raise InputError(f"{path}: expected signals (.npy) or a tile (.png)")
    signals = array_of(path, "signals")
    if signals.dtype.kind != "c" or signals.ndim != 2:
        raise InputError(
            f"{path}: {signals.dtype} {signals.shape}, expected complex (stations, symbols)"
        )
    return signals


def predict(trained: Trained, path: Path, settings: dict) -> dict[str, float]:
    """Return the probability of each category for one signal file or tile, in full precision.

    A signal of three stations, by a model of the zoo:

        >>> from lowalt.recognition.runs import opened
        >>> signal = np.exp(1j * np.arange(1200).reshape(3, 400) ** 1.4)
        >>> np.save("sample.npy", signal.astype(np.complex64))
        >>> model, settings = opened("default-seen")
        >>> list(predict(model, Path("sample.npy"), settings))
        ['UAV', 'Bird', 'Vehicle', 'Pedestrian']
    """
    return answer(trained, images_of(path, settings), settings, str(path))


def answer(trained: Trained, images: np.ndarray, settings: dict, where: str) -> dict[str, float]:
    """Return the probability of each category for all images of one sample.

    images: index images (stations spectra, S, S) uint8.
    settings: {network, spectra, images}; where: what the images are of, for refusals.
    Raises: InputError naming `where`, for images that the model does not see, or an answer that is
    not finite.
    """
    names = named(settings["spectra"])
    columns = columns_in(trained.scheme.columns, names, len(images) // len(names), where)
    views = torch.from_numpy(resize(images, trained.size)[columns][None])
    with torch.inference_mode():
        shares = trained.model(views).double().softmax(1)[0]
    if not torch.isfinite(shares).all():
        raise InputError(
            f"{trained.path}: answers {where} with numbers that are not finite, expected another "
            "model"
        )
    return dict(zip(trained.classes, shares.tolist(), strict=True))
