"""A recogniser for one's own radar: from the record of a recording to a trained, calibrated
network.

The record's block `twin` says what the samples cannot: waveform, where targets are, and how wide
the antenna looks. The twin is one station with one value a symbol: of a continuous wave the
receiver's samples, of frequency-modulated chirps the value of the target's range cell
(`chirps.slow_time`), of OFDM its channel estimate, one a symbol. At one range the three are the
same slow signal.
"""

import tempfile
from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import torch
from scipy.optimize import minimize_scalar
from torch import nn

from lowalt.extensions.formats import zoo
from lowalt.extensions.recordings.files import Baseband, read
from lowalt.extensions.recordings.presence import heard_powers, noise_floor
from lowalt.extensions.recordings.record import Record
from lowalt.extensions.recordings.twin import Twin, twin_of
from lowalt.extensions.recordings.twin_scenes import Library
from lowalt.extensions.recordings.twin_training import simulated, train
from lowalt.extensions.recordings.window_samples import Windows
from lowalt.extensions.recordings.windows import windows
from lowalt.files.errors import InputError
from lowalt.machine.progress import reported
from lowalt.recognition import model_card, model_file
from lowalt.recognition.inference import Machine, probabilities
from lowalt.recognition.model_file import of_run
from lowalt.recognition.runs import of_file

SPREAD_DB = 5.0
"""How far the twin's SNR reaches beyond that of the recording, to either side."""


def snr_range(record: Record, twin: Twin, baseband: Baseband) -> list[float]:
    """Return the range of SNR (dB) that the twin draws from: the recording's own, over its noise
    floor, and `SPREAD_DB` more to either side. The record's `snr_db` goes before.

    Raises: InputError as `windows`.
    """
    if record.twin is not None and "snr_db" in record.twin:
        return list(record.twin["snr_db"])
    power, heard = heard_powers(windows(record, twin, baseband), twin)
    floor = noise_floor(power, 2 * twin.edge_mps / twin.symbols)[heard].sum()
    over = np.maximum(power[:, heard].sum(axis=1) / floor - 1, 0.1)
    low, high = 10 * np.log10(np.quantile(over, [0.1, 0.9]))
    return [float(np.clip(low - SPREAD_DB, -10, 30)), float(np.clip(high + SPREAD_DB, 0, 45))]


def temperature(shares: np.ndarray, labels: np.ndarray) -> float:
    """Return the temperature by which logits are divided so that probabilities (n, classes) fit the
    labels (n,) best.

    Source: temperature scaling, Guo et al. 2017, On Calibration of Modern Neural Networks, ICML.
    """
    logits = np.log(np.maximum(shares, 1e-12))

    def loss(log_temperature: float) -> float:
        """Negative log likelihood a sample."""
        scaled = logits / np.exp(log_temperature)
        scaled -= scaled.max(axis=1, keepdims=True)
        return float(
            np.mean(np.log(np.exp(scaled).sum(axis=1)) - scaled[np.arange(len(labels)), labels])
        )

    return float(np.exp(minimize_scalar(loss, bounds=(-2.0, 3.0), method="bounded").x))


def last_layer(tensors: Iterable[str]) -> str:
    """Return the last layer of a network's classifier, such as "classifier.3", from the names of
    its tensors.

    Layers rank by their numbers: layer 10 comes after layer 9.
    """
    layers = {name.rpartition(".")[0] for name in tensors if name.startswith("classifier.")}
    return max(layers, key=lambda layer: [int(number) for number in layer.split(".")[1:]])


def calibrated(tensors: dict[str, torch.Tensor], temperature: float) -> dict[str, torch.Tensor]:
    """Return a network's tensors with its last layer divided by `temperature`, and so its logits.

    Source: as `temperature`.
    """
    last = last_layer(tensors)
    result = dict(tensors)
    for key in tensors:
        if key.rpartition(".")[0] == last:
            result[key] = tensors[key] / temperature
    return result


def trained_radar(record: Record, out: Path, block: dict) -> dict:
    """Train a network for the radar of a record, write OUT.safetensors, its weights in 8 bits, and
    its card; return what to expect of it.

    out: path without suffix; block: as `twin_training.settings` gives it. Validation windows choose
    the step, and the temperature is fitted on them; accuracy is that of the written file on scenes
    that neither saw ("test").
    Raises: InputError as `twin_of` and `read`.
    """
    baseband = _baseband(record)
    name = out.name
    seed = block["seeds"][0]
    twin = twin_of(record, baseband.rate_hz)
    library = Library.of({name: (record, twin, snr_range(record, twin, baseband))})
    classes = tuple(library.scenes[name])
    block = {**block, "echoes": {**block["echoes"], "test": block["echoes"]["validation"]}}
    parts = reported(("train", "validation", "test"), 3, "parts")
    folds = {fold: simulated(library, name, block, fold, classes) for fold in parts}
    with tempfile.TemporaryDirectory() as folder:
        network = train(
            block,
            {fold: folds[fold] for fold in ("train", "validation")},
            name,
            seed,
            folder,
            classes,
        )
        content = of_run(Path(folder) / "model.safetensors")
    validation, test = (folds[fold].facts.label for fold in ("validation", "test"))
    warm = temperature(_shares(network, folds["validation"]), validation)
    path = out.with_name(f"{name}.safetensors")
    content = replace(content, tensors=calibrated(content.tensors, warm))
    reduced = zoo.small(content)
    exact, entry = (of_file(weights, path) for weights in (content, reduced))
    shares = _shares(entry.model, folds["test"])
    right = shares.argmax(1) == test
    made_with = {
        "network": twin.network_settings(),
        "spectra": twin.spectra_settings(),
        "images": block["images"],
    }
    told = {"radar": asdict(twin), "caution": (record.twin or {}).get("caution", "")}
    told["expected"] = {"windows": len(right), "percent": float(100 * right.mean())}
    reduced = replace(
        reduced,
        measured=zoo.held_against(exact, entry, folds["validation"]),
        input=made_with | told,
    )
    model_file.write(path, reduced)
    model_card.write(path, reduced, [])
    by_class = {
        label: float(100 * right[test == number].mean()) for number, label in enumerate(classes)
    }
    return {
        "file": path,
        "twin": asdict(twin),
        **told["expected"],
        "percent_by_class": by_class,
        "temperature": warm,
        "mean_probability_percent": float(100 * shares.max(axis=1).mean()),
    }


def _baseband(record: Record) -> Baseband:
    """The samples of a record's file; none, at the record's rate, where it describes a radar
    without any recording.

    Raises: InputError as `read`, and where neither a recording nor the record says at which SNR
    targets are seen.
    """
    if record.recorded:
        return read(record)
    if "snr_db" not in (record.twin or {}):
        raise InputError(
            f"{record.file}: no recording to measure the noise in, expected `file`, or twin.snr_db,"
            " the least and largest SNR in dB"
        )
    return Baseband(np.empty(0), float(record.rate_hz or 0))


def _shares(network: nn.Module, windows: Windows) -> np.ndarray:
    """The probabilities (n, classes) of a network for windows."""
    return probabilities(network, windows, np.arange(len(windows.images)), Machine.here("fp32"), 64)
