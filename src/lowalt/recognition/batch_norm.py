"""Batch norm over the whole batch of all ranks, on CPUs too: a step of several ranks is then that of one.

torch's own SyncBatchNorm runs on GPUs only. Here the sums over a rank's share are added over the ranks by an
all-reduce that passes gradients back, so every rank normalises with the mean and variance of the whole batch.
"""

import torch
from torch import distributed, nn


class _Sum(torch.autograd.Function):
    """Sum of a tensor over the ranks. Every rank's loss depends on it, so gradients are summed over the ranks too."""

    @staticmethod
    def forward(_, values: torch.Tensor) -> torch.Tensor:
        """Return the sum of `values` over all ranks."""
        total = values.clone()
        distributed.all_reduce(total)
        return total

    @staticmethod
    def backward(_, gradient: torch.Tensor) -> torch.Tensor:
        """Return the sum of the gradients of all ranks."""
        total = gradient.contiguous().clone()
        distributed.all_reduce(total)
        return total


class BatchNormOverRanks(nn.BatchNorm2d):
    """`nn.BatchNorm2d` with its statistics over all ranks; outside training it is exactly that layer."""

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """Normalise images (B, channels, rows, columns) by channel; B may differ between the ranks."""
        if not self.training:
            return self.after(super().forward(images))
        values = images.float()
        count = values.new_full((1,), values.numel() // values.shape[1])
        # Two all-reduces: deviations from the common mean lose no digits where the mean is large.
        total = _Sum.apply(torch.cat([values.sum((0, 2, 3)), count]))
        mean, count = total[:-1] / total[-1], total[-1].detach()
        apart = values - mean[:, None, None]
        variance = _Sum.apply(apart.square().sum((0, 2, 3))) / count
        with torch.no_grad():
            self.num_batches_tracked += 1
            self.running_mean.lerp_(mean, self.momentum)
            self.running_var.lerp_(variance * count / (count - 1), self.momentum)
        scale = self.weight * torch.rsqrt(variance + self.eps)
        normalised = apart * scale[:, None, None] + self.bias[:, None, None]
        return self.after(normalised.to(images.dtype).contiguous(memory_format=torch.channels_last))


def over_ranks(model: nn.Module) -> nn.Module:
    """Return the model with every 2-D batch norm replaced by one over all ranks; names of weights stay the same.

    timm's layers of norm and activation in one keep their activation.
    """
    for name, layer in model.named_children():
        if not isinstance(layer, nn.BatchNorm2d):
            over_ranks(layer)
            continue
        new = BatchNormOverRanks(layer.num_features, layer.eps, layer.momentum, layer.affine, layer.track_running_stats)
        new.load_state_dict(layer.state_dict())
        new.after = nn.Sequential(*(part for key, part in layer.named_children() if key in ("drop", "act")))
        setattr(model, name, new.to(layer.weight.device))
    return model
