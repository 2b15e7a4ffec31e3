"""The recipe of a training run: its settings, rates over time, optimiser, fixed randomness.

Settings are the block `recognition.training` of workflow/schemas/config.schema.yaml, which says
what each means.
"""

import math
import os

import torch
from torch import nn

from lowalt.config.schema import check_brought
from lowalt.files.errors import InputError
from lowalt.numerics.streams import digest

OPTIONAL = {"accumulate": 1, "activation_checkpointing": False}
"""Keys that a block may leave out, with the values that they have then."""


def check(block: dict) -> dict:
    """Return the block, OPTIONAL filled in.

    Raises: InputError naming the key, its value and what was expected.
    """
    check_brought("training", block, "recognition.training")
    block = OPTIONAL | block
    if block["accumulate"] > block["batch"]:
        raise InputError(
            f"training: accumulate is {block['accumulate']}, expected at most batch, "
            f"{block['batch']}"
        )
    return block


def schedule(share: float, warmup: float) -> float:
    """Factor on the learning rate after `share` (0..1) of all steps.

    It rises linearly up to `warmup`, then falls as a cosine to 0.

    >>> [round(schedule(share, 0.1), 3) for share in (0.05, 0.1, 0.55, 1.0)]
    [0.5, 1.0, 0.5, 0.0]
    """
    if share < warmup:
        return share / warmup
    if warmup >= 1:
        return 1.0
    return 0.5 * (1 + math.cos(math.pi * (share - warmup) / (1 - warmup)))


def averaging(decay: float, step: int) -> float:
    """Weight of the old average after `step` (1, 2, ...).

    The average is then sum d^k w_k / sum d^k over all ages k.

    A constant weight d would keep the first, random weights in the average for 1 / (1 - d) steps.
    Source: the bias correction of Kingma and Ba, Adam, 2015, section 3.

        >>> [round(averaging(0.5, step), 3) for step in (1, 2, 9)]
        [0.0, 0.333, 0.499]
    """
    if decay < 1:
        return 1 - (1 - decay) / (1 - decay**step)
    return 1 - 1 / step


def optimiser(model: nn.Module, block: dict) -> torch.optim.AdamW:
    """Return AdamW with four groups: backbone or not, matrix (decayed) or not."""
    groups = []
    for of_backbone, factor in ((True, block["backbone_rate"]), (False, 1.0)):
        for matrix, decay in ((True, block["weight_decay"]), (False, 0.0)):
            members = []
            for name, value in model.named_parameters():
                is_matrix = value.ndim > 1 and "modality" not in name
                if name.startswith("backbone.") == of_backbone and is_matrix == matrix:
                    members.append(value)
            if members:
                groups.append({"params": members, "factor": factor, "weight_decay": decay})
    return torch.optim.AdamW(groups, lr=block["rate"], fused=True)


def seeded(seed: int, keys: tuple, threads: int) -> None:
    """Fix what torch draws from and sums with: seed, thread count, deterministic algorithms."""
    torch.manual_seed(int.from_bytes(digest(seed, "recognition-torch", *keys)[:8], "little") >> 1)
    torch.set_num_threads(threads)
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
    torch.use_deterministic_algorithms(True)
    # Filling every new tensor helps to find reads of unset memory. This code has none, and filling
    # costs a tenth of the time.
    torch.utils.deterministic.fill_uninitialized_memory = False


def random_state(device: torch.device) -> dict[str, torch.Tensor]:
    """Return the states of the generators that a training on `device` draws from.

    They are the processor's and, on a GPU, that GPU's own.
    All ranks draw the same numbers, so one rank's states serve all.
    """
    states = {"cpu": torch.get_rng_state()}
    if device.type == "cuda":
        states["cuda"] = torch.cuda.get_rng_state(device)
    return states


def set_random_state(device: torch.device, states: dict[str, torch.Tensor]) -> None:
    """Take up the states of `random_state`.

    Raises: InputError where a training that ran on another kind of device is to go on.
    """
    if ("cuda" in states) != (device.type == "cuda"):
        raise InputError(
            f"checkpoint: random states of {sorted(states)}, but this training runs on "
            f"{device.type}"
        )
    torch.set_rng_state(states["cpu"])
    if device.type == "cuda":
        torch.cuda.set_rng_state(states["cuda"], device)
