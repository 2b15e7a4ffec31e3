"""Class probabilities of a network; any number of ranks gives the same bits."""

import contextlib
import hashlib
import os
from dataclasses import dataclass

import numpy as np
import timm
import torch
from torch import distributed, nn

from lowalt.config.command import pick
from lowalt.files.errors import InputError
from lowalt.recognition import gpus
from lowalt.recognition.batches import Prefetch, Unchanged
from lowalt.recognition.matrix_products import as_products
from lowalt.recognition.samples import Samples


def arithmetic(precision: str, device: str) -> str:
    """Return "bf16" or "fp32" for a setting; "auto" is bf16 where the hardware multiplies it.

    device: "cpu" or "cuda". A processor without such units emulates bf16 and takes ten times as
    long as in fp32.
    """
    if precision != "auto":
        return precision
    if device == "cuda":
        has_units = torch.cuda.is_bf16_supported(including_emulation=False)
    else:
        known = torch.cpu.get_capabilities()
        # Arm processors use other names for these units.
        has_units = any(known.get(unit) for unit in ("amx_bf16", "avx512_bf16", "bf16"))
    return "bf16" if has_units else "fp32"


@dataclass(frozen=True)
class Machine:
    """Where torch runs: device, arithmetic ("bf16" or "fp32"), and the rank under torchrun."""

    device: torch.device
    precision: str
    rank: int = 0
    ranks: int = 1

    @classmethod
    def here(cls, precision: str) -> "Machine":
        """Return this process's machine: a free GPU if there is any, else the CPU.

        Under torchrun, ranks take the visible GPUs in order and communicate by nccl (GPU) or gloo
        (CPU).
        precision: "auto", "bf16" or "fp32". Raises: InputError where a rank finds no GPU left.
        """
        gpu = torch.cuda.is_available()
        ranks = int(os.environ.get("WORLD_SIZE", "1"))
        number = int(os.environ.get("LOCAL_RANK", "0"))
        count = torch.cuda.device_count()
        if gpu and ranks == 1:
            uuids = [str(torch.cuda.get_device_properties(each).uuid) for each in range(count)]
            number = gpus.claimed(tuple(uuids))
        elif gpu and number >= count:
            raise InputError(
                f"training: process {number} of this machine finds {count} GPUs, expected no more "
                "processes than GPUs"
            )
        device = torch.device(f"cuda:{number}" if gpu else "cpu")
        if ranks > 1 and not distributed.is_initialized():
            distributed.init_process_group("nccl" if gpu else "gloo")
        rank = int(os.environ.get("RANK", "0"))
        return cls(device, arithmetic(precision, device.type), rank, ranks)

    @property
    def gpu(self) -> bool:
        """Whether the device is a GPU."""
        return self.device.type == "cuda"

    def placed(self, model: nn.Module) -> nn.Module:
        """Return a model on the device for predictions, in the form that is computed fastest."""
        if self.gpu or self.precision != "fp32":
            return model.to(self.device)
        return as_products(model).to(self.device, memory_format=torch.channels_last)

    def autocast(self) -> contextlib.AbstractContextManager:
        """Return the context of mixed precision (bfloat16), or none for fp32."""
        if self.precision == "fp32":
            return contextlib.nullcontext()
        return torch.autocast(self.device.type, torch.bfloat16)

    def with_shared_statistics(self, model: nn.Module) -> nn.Module:
        """Return the model with every batch norm taking its statistics over all ranks.

        torch offers this on GPUs.
        Raises: InputError for a batch norm that several ranks would train on processors.
        """
        if self.ranks == 1:
            return model
        layers = [
            name
            for name, layer in model.named_modules()
            if isinstance(layer, nn.modules.batchnorm._BatchNorm)
        ]
        if layers and not self.gpu:
            raise InputError(
                f"training: {self.ranks} processes on processors share no batch norm, and the "
                f"backbone has {layers[0]}; expected GPUs, one process, or a backbone without "
                "batch norm"
            )
        return timm.layers.convert_sync_batchnorm(model)

    def parallel(self, model: nn.Module) -> nn.Module:
        """Return the model, wrapped for gradient exchange where there are several ranks."""
        if self.ranks == 1:
            return model
        return nn.parallel.DistributedDataParallel(model)

    def agree(self, identity: str, steps: int) -> None:
        """Refuse ranks whose settings, samples or steps differ, since the result would not show it.

        identity: all that determines the weights; steps: those done before. Raises: InputError on
        every rank.
        """
        if self.ranks == 1:
            return
        number = int(hashlib.sha256(f"{steps} {identity}".encode()).hexdigest()[:12], 16)
        bounds = torch.tensor([number, -number], device=self.device)
        distributed.all_reduce(bounds, distributed.ReduceOp.MAX)
        if int(bounds.sum()):
            raise InputError(
                f"training: rank {self.rank} computes in {self.precision} and stands at step "
                f"{steps}, another rank differs in that or in its samples; expected identical "
                "nodes that see the same files (with an explicit training.precision instead of "
                "auto, different nodes compute alike)"
            )


def evaluation(block: dict) -> list:
    """Return batch, threads, precision, mirror and workers of the block `recognition.evaluation`.

    workers is 0 where the block leaves it out.
    Raises: InputError naming a missing or unknown key.
    """
    return pick({"workers": 0} | block, "batch", "threads", "precision", "mirror", "workers")


@torch.inference_mode()
def probabilities(
    model: nn.Module,
    samples: Samples,
    numbers: np.ndarray,
    machine: Machine,
    batch: int,
    mirror: bool = False,
    ahead: Prefetch | None = None,
) -> np.ndarray:
    """Return class probabilities (len(numbers), classes) float64 of the samples `numbers`.

    mirror: average with the probabilities of the inputs mirrored along Doppler, which show the
    target turned by 180 degrees. ahead: reads the samples' images (`Unchanged`) in worker
    processes; without it this process reads them. Each rank gets whole batches, so that sums do not
    depend on the number of ranks.
    """
    model.eval()
    result = torch.zeros(len(numbers), model.classes, dtype=torch.float64)
    mine = list(range(0, len(numbers), batch))[machine.rank :: machine.ranks]
    ahead = ahead or Prefetch(Unchanged(samples), 0, pin=False)
    read = ahead([numbers[start : start + batch] for start in mine])
    for start, inputs in zip(mine, read, strict=True):
        images = inputs.to(machine.device, non_blocking=True)
        shown = [images]
        if mirror:
            shown.append(model.mirrored(images))
        with machine.autocast():
            logits = [model(each) for each in shown]
        shares = torch.stack([value.double().softmax(1) for value in logits])
        result[start : start + batch] = shares.mean(0).cpu()
    if machine.ranks > 1:
        # Each entry is non-zero on one rank only, so the sum is exact.
        result = result.to(machine.device)
        distributed.all_reduce(result)
        result = result.cpu()
    return result.numpy()
