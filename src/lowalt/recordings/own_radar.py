"""A recogniser for one's own radar: from the record of a recording to a trained, calibrated network.

The record's block `twin` says what the samples cannot: waveform, where targets are, and how wide the antenna looks. The
twin is one station with one value a symbol: of a continuous wave the receiver's samples, of frequency-modulated chirps
the value of the target's range cell (`chirps.slow_time`), of OFDM its channel estimate, one a symbol. At one range
the three are the same slow signal.
"""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import torch
from scipy.optimize import minimize_scalar

from lowalt.config.classes import CATEGORIES
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.recognition import model_card, model_file
from lowalt.recognition.inference import Machine, probabilities
from lowalt.recognition.model_file import of_run
from lowalt.recordings.files import Baseband, read
from lowalt.recordings.presence import heard_powers, noise_floor
from lowalt.recordings.record import Record
from lowalt.recordings.twin import TWINS, Twin, settings_of
from lowalt.recordings.twin_scenes import Library
from lowalt.recordings.twin_training import simulated, train
from lowalt.recordings.windows import windows
from lowalt.targets.records import load_records

ASKED = ("waveform", "distance_m", "height_m", "beam_deg")
"""Keys of the block `twin` that nothing else can say."""
FASTEST_MPS, WINDOW_S = 20.0, 0.4
LEAST_SYMBOLS, MOST_SYMBOLS = 400, 1200
"""Symbols of a window: the spectra need 400; more than 1200 add time and no class."""
SLOWEST_MPS, DETECT_DB = 0.4, 12.0
WHOLE = 0.02
"""How far the symbol rate may be moved for a whole number of samples a symbol."""
ROOM_M = 2.5
"""Least distance between the ends of a walk."""
SPREAD_DB = 5.0
"""How far the twin's SNR reaches beyond that of the recording, to either side."""
RECEIVER = {"flicker_db": [0.0, 20.0], "flicker_hz": [2.0, 100.0], "wander_db": [0.0, 1.0], "leak_db": [0.0, 30.0],
            "hum_db": [-60.0, -20.0], "hum_hz": [50.0, 1000.0]}  # fmt: skip
"""Ranges of a cheap receiver, between those of the three measured radars (`config/measured/twins.yaml`)."""


def twin_of(record: Record, rate_hz: float) -> Twin:
    """Return the twin of the radar that made a recording at `rate_hz` samples (or chirps, or OFDM symbols) a second.

    The symbol rate keeps speeds up to the block's `fastest_mps` apart where the radar is fast enough for it.
    Raises: InputError naming the keys of the block `twin` that are missing, or a sampling that the channel has not.
    """
    said = record.twin or {}
    missing = [key for key in ASKED if key not in said]
    if missing:
        raise InputError(f"{record.file}: the record says nothing of {', '.join(missing)}, expected a block twin "
                         "such as {waveform: cw, distance_m: [2, 10], height_m: [-1, 2], beam_deg: 60}")  # fmt: skip
    one_sided = record.channel == "real" and said.get("sampling", "one_sided") == "one_sided"
    # Unambiguous are lambda / 4 T of a complex channel, twice that of a one-sided one.
    wanted_hz = (2 if one_sided else 4) * said.get("fastest_mps", FASTEST_MPS) * record.carrier_hz / SPEED_OF_LIGHT
    every = max(1.0, rate_hz / wanted_hz)
    every = round(every) if abs(every - round(every)) < WHOLE * every else every
    symbol_hz = rate_hz / every
    usual = "one_sided" if one_sided else "anti_aliased"
    sampling = said.get("sampling", usual if every > 1 or one_sided else "bare")
    symbols = int(np.clip(round(said.get("window_s", WINDOW_S) * symbol_hz), LEAST_SYMBOLS, MOST_SYMBOLS))
    simulated_hz = symbol_hz if sampling == "bare" else min(rate_hz, 2 * symbol_hz)
    return Twin(
        record.carrier_hz, record.channel, simulated_hz, 1 / symbol_hz, symbols, sampling, SLOWEST_MPS, DETECT_DB
    )


def snr_range(record: Record, twin: Twin, baseband: Baseband) -> list[float]:
    """Return the range of SNR (dB) that the twin draws from: the recording's own, over its noise floor, and
    `SPREAD_DB` more to either side. The record's `snr_db` goes before.

    Raises: InputError as `windows`.
    """
    if "snr_db" in record.twin:
        return list(record.twin["snr_db"])
    power, heard = heard_powers(windows(record, twin, baseband), twin)
    floor = noise_floor(power, 2 * twin.edge_mps / twin.symbols)[heard].sum()
    over = np.maximum(power[:, heard].sum(axis=1) / floor - 1, 0.1)
    low, high = 10 * np.log10(np.quantile(over, [0.1, 0.9]))
    return [float(np.clip(low - SPREAD_DB, -10, 30)), float(np.clip(high + SPREAD_DB, 0, 45))]


def _scene(scene: dict, said: dict) -> dict:
    """A scene of the shared ones, with the distances, heights and beam of the record."""
    near, far = said["distance_m"]
    scene = {**scene, "height_m": said["height_m"]}
    scene["beam"] = {"width_deg": said["beam_deg"], "floor_db": -20.0}
    if scene["course"] == "hover":
        scene["distance_m"] = [near, far]
    elif scene["course"] == "pass":
        scene |= {"lateral_m": [near, max(near, far / 3)], "ahead_m": [-far / 4, far]}
    else:
        last = near + 0.2 * (far - near)
        scene |= {"near_m": [near, last], "far_m": [max(last + ROOM_M, 0.6 * far), max(last + ROOM_M, far)]}
    return scene


def library_of(record: Record, twin: Twin, snr_db: list[float], name: str) -> tuple[Library, tuple[str, ...]]:
    """Return the scenes of a twin, by the shared ones of `config/measured/twins.yaml`, and the record's classes."""
    block, said = settings_of(TWINS), record.twin
    classes = tuple(said.get("classes", CATEGORIES))
    receiver = RECEIVER | {"snr_db": snr_db}
    scenes = {label: [{**_scene(scene, said), "receiver": receiver} for scene in block["scenes"][label]]
              for label in classes}  # fmt: skip
    records = load_records(shipped(block["targets"]["table"]), [shipped(path) for path in block["targets"]["records"]])
    return Library(int(block["seed"]), {name: twin}, {name: []}, {name: scenes}, records), classes


def temperature(shares: np.ndarray, labels: np.ndarray) -> float:
    """Return the temperature by which logits are divided so that probabilities (n, classes) fit the labels (n,) best.

    Source: temperature scaling, Guo et al. 2017, On Calibration of Modern Neural Networks, ICML.
    """
    logits = np.log(np.maximum(shares, 1e-12))

    def loss(log_temperature: float) -> float:
        """Negative log likelihood a sample."""
        scaled = logits / np.exp(log_temperature)
        scaled -= scaled.max(axis=1, keepdims=True)
        return float(np.mean(np.log(np.exp(scaled).sum(axis=1)) - scaled[np.arange(len(labels)), labels]))

    return float(np.exp(minimize_scalar(loss, bounds=(-2.0, 3.0), method="bounded").x))


def trained_radar(record: Record, out: Path, block: dict) -> dict:
    """Train a network for the radar of a recording, and write OUT.safetensors and its card; return what to expect.

    out: path without suffix; block: as `twin_training.settings` gives it. Half of the validation windows choose the
    step, the temperature is fitted on the same, and accuracy is measured on scenes that neither saw ("test").
    Raises: InputError as `twin_of` and `read`.
    """
    baseband = read(record)
    twin, name = twin_of(record, baseband.rate_hz), out.name
    library, classes = library_of(record, twin, snr_range(record, twin, baseband), name)
    block = {**block, "echoes": {**block["echoes"], "test": block["echoes"]["validation"]}}
    folds = {fold: simulated(library, name, block, fold, classes) for fold in ("train", "validation", "test")}
    seed, folder = block["seeds"][0], out.with_name(f"{name}-training")
    network = train(block, {fold: folds[fold] for fold in ("train", "validation")}, name, seed, folder, classes)
    machine = Machine.here("fp32")
    shares = {fold: probabilities(network, folds[fold], np.arange(len(folds[fold].images)), machine, 64)
              for fold in ("validation", "test")}  # fmt: skip
    warm = temperature(shares["validation"], folds["validation"].facts.label)
    content = of_run(folder / "model.pt")
    last = max(key.rpartition(".")[0] for key in content.tensors if key.startswith("classifier"))
    cooled = {key: value / warm if key.rpartition(".")[0] == last else value for key, value in content.tensors.items()}
    made_with = {"network": twin.network_settings(), "spectra": twin.spectra_settings(), "images": block["images"]}
    content = replace(content, tensors=cooled, input={**made_with, "radar": asdict(twin)})
    path = out.with_name(f"{name}.safetensors")
    model_file.write(path, content)
    model_card.write(path, content, [])
    right = shares["test"].argmax(1) == folds["test"].facts.label
    by_class = {label: float(100 * right[folds["test"].facts.label == number].mean())
                for number, label in enumerate(classes)}  # fmt: skip
    said = torch.softmax(torch.log(torch.from_numpy(np.maximum(shares["test"], 1e-12))) / warm, 1).numpy().max(axis=1)
    return {
        "file": path, "twin": asdict(twin), "windows": len(right), "percent": float(100 * right.mean()),
        "percent_by_class": by_class, "temperature": warm, "mean_probability_percent": float(100 * said.mean()),
    }  # fmt: skip
