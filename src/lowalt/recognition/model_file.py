"""A trained model as one safetensors file, which any program reads without running code.

The file's metadata has one entry, `lowalt`, a JSON object (the library writes several entries in
random order):
    identity    all that determined the weights, as in the training's checkpoint: settings,
                scheme, protocol, SHA-256 of the samples, version of torch; trained_on, the
                [subtype, fold, motion models] of those that trained
    model       scheme, protocol, network, size, seed, colour_map, classes; start, where it had one
    run         content of the training's run.json; {} where there was none
    input       network, spectra and images of the run's configuration; {} where there was none
    weights     "as trained", or "8 bits": each row of a matrix as whole numbers -127..127 and one
                scale (float32), a quarter of the bytes; biases, norms, running means and colours
                stay as they are
    measured    of 8-bit weights: how they change the answers (`zoo`)
    digest      SHA-256 of everything above and of every tensor
Source of 8 bits: Krishnamoorthi, Quantizing deep convolutional networks, arXiv:1806.08342, 2018,
per-channel symmetric.
"""

import hashlib
import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from lowalt.config.blocks import render_blocks
from lowalt.config.schema import check_brought
from lowalt.files.atomic import existing, write_file
from lowalt.files.errors import InputError, in_one_line
from lowalt.files.json_objects import json_object, read_object
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition import checkpoint

SCALE = ".scale"
"""Added to the name of a matrix: the name of its scales, (rows,) float32."""
LARGEST = 127
"""Largest whole number of an 8-bit weight."""
EXACT = "as trained"
EIGHT = "8 bits"


@dataclass(frozen=True)
class ModelFile:
    """Content of a file: `tensors` by name, as stored; the other fields as in the metadata."""

    tensors: dict[str, torch.Tensor]
    identity: dict
    model: dict
    run: dict
    input: dict
    weights: str = EXACT
    measured: dict | None = None

    def about(self) -> dict:
        """Return the metadata without its digest."""
        return {name: value for name, value in vars(self).items() if name != "tensors"}


def run_folder(model: str | Path) -> Path | None:
    """Return the folder of the run that a model lies in, None where it lies in none."""
    # RUN/models/PROTOCOL/SCHEME/SEED/
    scheme_folder = Path(model).resolve().parent.parent
    models = scheme_folder.parent.parent
    if models.name != "models":
        return None
    return models.parent


def of_run(path: str | Path) -> ModelFile:
    """Return the content of a training's model.safetensors, with the records next to it and above.

    Raises: InputError where the model is missing or damaged.
    """
    content = read(path)
    run: dict = {}
    record = Path(path).with_name("run.json")
    if record.is_file():
        run = read_object(record, "a run record")
    blocks: dict = {}
    folder = run_folder(path)
    if folder and (folder / "config.yaml").is_file():
        config = load_yaml(folder / "config.yaml")
        if config:
            blocks = render_blocks(config)
    return replace(content, run=run, input=blocks)


def _digest(tensors: dict[str, torch.Tensor], about: dict) -> str:
    """SHA-256 of the metadata and of all tensors, by name."""
    hasher = hashlib.sha256(json.dumps(about, sort_keys=True).encode())
    for name, value in sorted(tensors.items()):
        hasher.update(f"{name} {value.dtype} {tuple(value.shape)}".encode())
        hasher.update(value.contiguous().flatten().view(torch.uint8).numpy().tobytes())
    return hasher.hexdigest()


def packed(content: ModelFile) -> bytes:
    """Return the bytes of a model file; equal content gives equal bytes."""
    about = content.about()
    about["digest"] = _digest(content.tensors, about)
    return save(content.tensors, {"lowalt": json.dumps(about, sort_keys=True)})


def write(path: str | Path, content: ModelFile) -> None:
    """Write a model file."""
    write_file(path, packed(content))


def read(path: str | Path) -> ModelFile:
    """Return the content of a model file.

    Raises: InputError where it is missing, damaged, or not written by this project.
    """
    existing(path, "model")
    try:
        with safe_open(path, framework="pt") as file:
            about = json_object((file.metadata() or {})["lowalt"], path, "a model file")
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        digest = about.pop("digest")
        computed = _digest(tensors, about)
    except InputError:
        raise
    except (
        SafetensorError,
        OSError,
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        RecursionError,
    ) as error:
        raise InputError(
            f"{path}: not a model file of lowalt ({type(error).__name__}: {in_one_line(error)})"
        ) from error
    if computed != digest:
        raise InputError(f"{path}: model file is damaged, its content does not match its SHA-256")
    check_brought("about", about, path)
    checkpoint.check_model(about["identity"], about["model"], path)
    return ModelFile(tensors, **about)


def weights_of(content: ModelFile, path: str | Path) -> dict[str, torch.Tensor]:
    """Return the weights by name, as the network takes them; path: where they came from.

    Raises: InputError where 8-bit weights and scales do not fit together.
    """
    if content.weights != EIGHT:
        return content.tensors
    try:
        return restored(content.tensors)
    except (KeyError, TypeError, IndexError, RuntimeError) as error:
        raise InputError(f"{path}: not a trained model ({in_one_line(error)})") from error


def rounded(
    weights: Mapping[str, torch.Tensor], matrices: Collection[str]
) -> dict[str, torch.Tensor]:
    """Return weights by name, those named in `matrices` as int8 of the same shape, with scales.

    weights: float32 (rows, ...) where they are to be rounded.
    """
    stored = {}
    for name, value in weights.items():
        if name not in matrices:
            stored[name] = value
            continue
        rows = value.contiguous().flatten(1)
        scale = rows.abs().amax(1) / LARGEST
        # A row of zeros keeps them with any scale.
        steps = rows / torch.where(scale > 0, scale, 1)[:, None]
        stored[name] = steps.round().clamp(-LARGEST, LARGEST).to(torch.int8).view(value.shape)
        stored[name + SCALE] = scale
    return stored


def restored(tensors: Mapping[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Return the weights by name, all as the network takes them: rows times scales.

    Raises: KeyError for an int8 matrix without scales.
    """
    scales = {name + SCALE for name, value in tensors.items() if value.dtype == torch.int8}
    weights = {}
    for name, value in tensors.items():
        if value.dtype == torch.int8:
            weights[name] = (value.flatten(1).float() * tensors[name + SCALE][:, None]).view(
                value.shape
            )
        elif name not in scales:
            weights[name] = value
    return weights
