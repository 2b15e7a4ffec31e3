"""The recipe of a training run: its settings and their ranges, learning rate over time, optimiser, fixed randomness.

Settings of this module, the block `recognition.training`:
    steps            at most this many, so that runs on few and on many samples cost the same
    batch            samples a step, over all ranks
    snrs_per_model   SNRs of each motion model visited an epoch, 0 for all
    rate             largest learning rate (AdamW)
    backbone_rate    factor on it for the backbone
    weight_decay     of matrices; norms, biases and the modality embedding have none
    warmup           share of the steps in which the rate rises linearly; then it falls as a cosine to 0
    clip             largest norm of the gradient
    label_smoothing  0..1
    alone            weight of a second loss, on each station as if it were the only one; 0 for none. The backbone then
                     learns from every station of a sample
    ema              decay d of the moving average of the weights: weights of k steps ago count d^k, relative to the
                     latest; 0 for none
    precision        auto (bf16 where the hardware has it, else fp32) | bf16 (autocast) | fp32
    channels_last    memory layout of images and convolutions
    compile          torch.compile the network
    validate_every   steps between validations
    patience         validations without a better accuracy before stopping; 0 never stops
    checkpoint_s     seconds between checkpoints
    threads          CPU threads; fixed, since their number moves the last bits
    workers          processes that read samples, and as many for validation; 0 reads in the training process
and, where they are given:
    accumulate       parts a batch is cut into, one after the other through the network; their gradients are added up.
                     Only one part's activations are in memory. A batch norm sees one part at a time
    activation_checkpointing  keep few activations of the backbone and compute the others again for the gradient
"""

import math
import os
from types import ModuleType

import torch
from torch import nn

from lowalt.config.command import pick
from lowalt.files.errors import InputError
from lowalt.numerics.streams import digest
from lowalt.recognition.flat_weights import FlatAdamW

KEYS = (
    "steps", "batch", "snrs_per_model", "rate", "backbone_rate", "weight_decay", "warmup", "clip",
    "label_smoothing", "alone", "ema", "precision", "channels_last", "compile", "validate_every", "patience",
    "checkpoint_s", "threads", "workers",
)  # fmt: skip
OPTIONAL = {"accumulate": 1, "activation_checkpointing": False}
"""Keys that a block may leave out, with the values that they have then."""


WHOLE = {
    "steps": 1, "batch": 1, "snrs_per_model": 0, "validate_every": 1, "patience": 0, "threads": 1, "workers": 0,
    "accumulate": 1,
}  # fmt: skip
"""Smallest value of every whole number."""
REAL = {
    "rate": math.inf, "backbone_rate": math.inf, "weight_decay": math.inf, "warmup": 1, "clip": math.inf,
    "label_smoothing": 1, "alone": math.inf, "ema": 1, "checkpoint_s": math.inf,
}  # fmt: skip
"""Largest value of every real number; the smallest is 0."""
PRECISIONS = ("auto", "bf16", "fp32")


def check(block: dict) -> dict:
    """Return the block, OPTIONAL filled in, if every key is there and in range.

    Raises: InputError naming the key and value.
    """
    block = OPTIONAL | block
    pick(block, *KEYS, *OPTIONAL)
    for key, least in WHOLE.items():
        if not isinstance(block[key], int) or isinstance(block[key], bool) or block[key] < least:
            raise InputError(f"training: {key} is {block[key]!r}, expected a whole number >= {least}")
    for key, most in REAL.items():
        value = block[key]
        if not isinstance(value, (int, float)) or isinstance(value, bool) or not 0 <= value <= most:
            raise InputError(f"training: {key} is {value!r}, expected a number in 0..{most}")
    if block["precision"] not in PRECISIONS:
        raise InputError(f"training: precision is {block['precision']!r}, expected one of {PRECISIONS}")
    if block["accumulate"] > block["batch"]:
        raise InputError(f"training: accumulate is {block['accumulate']}, expected at most batch, {block['batch']}")
    return block


def schedule(share: float, warmup: float) -> float:
    """Factor on the learning rate after `share` (0..1) of all steps: linear up to `warmup`, then a cosine to 0."""
    if share < warmup:
        return share / warmup
    return 0.5 * (1 + math.cos(math.pi * (share - warmup) / (1 - warmup))) if warmup < 1 else 1.0


def averaging(decay: float, step: int) -> float:
    """Weight of the old average after `step` (1, 2, ...) so that the average is sum d^k w_k / sum d^k over all ages k.

    A constant weight d would keep the first, random weights in the average for 1 / (1 - d) steps. Source: the bias
    correction of Kingma and Ba, Adam, 2015, section 3.
    """
    return 1 - (1 - decay) / (1 - decay**step) if decay < 1 else 1 - 1 / step


def optimiser(model: nn.Module, block: dict, flat: bool = False) -> torch.optim.AdamW:
    """Return AdamW with four groups: backbone or not, matrix (decayed) or not.

    flat: lay the weights of each group end to end and step on them as one (`flat_weights`).
    """
    groups = []
    named = list(model.named_parameters())
    for ours in (True, False):
        for matrix in (True, False):
            members = [
                value
                for name, value in named
                if name.startswith("backbone.") == ours and (value.ndim > 1 and "modality" not in name) == matrix
            ]
            factor = block["backbone_rate"] if ours else 1.0
            decay = block["weight_decay"] if matrix else 0.0
            if members:
                groups.append({"params": members, "factor": factor, "weight_decay": decay})
    return (FlatAdamW if flat else torch.optim.AdamW)(groups, lr=block["rate"], fused=True)


def seeded(seed: int, keys: tuple, threads: int) -> None:
    """Fix everything torch draws from or sums with: seed of the run, thread count, deterministic algorithms."""
    torch.manual_seed(int.from_bytes(digest(seed, "recognition-torch", *keys)[:8], "little") >> 1)
    torch.set_num_threads(threads)
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
    torch.use_deterministic_algorithms(True)
    # Filling every new tensor helps to find reads of unset memory. This code has none, and filling costs a tenth of the
    # time.
    torch.utils.deterministic.fill_uninitialized_memory = False


def random_state(device: torch.device, cuda: ModuleType = torch.cuda) -> dict[str, torch.Tensor]:
    """Return the states of the generators that a training on `device` draws from: the processor's, and a GPU's own.

    cuda: the module that reads a GPU's generator. All ranks draw the same numbers, so one rank's states serve all.
    """
    states = {"cpu": torch.get_rng_state()}
    return {**states, "cuda": cuda.get_rng_state(device)} if device.type == "cuda" else states


def set_random_state(device: torch.device, states: dict[str, torch.Tensor], cuda: ModuleType = torch.cuda) -> None:
    """Take up the states of `random_state`.

    Raises: InputError where a training that ran on another kind of device is to go on.
    """
    if ("cuda" in states) != (device.type == "cuda"):
        raise InputError(f"checkpoint: random states of {sorted(states)}, but this training runs on {device.type}")
    torch.set_rng_state(states["cpu"])
    if device.type == "cuda":
        cuda.set_rng_state(states["cuda"], device)
