"""The moving average of a model's weights, updated at every step: `ModelEmaV3`, which lists its tensors only once."""

import torch
from timm.utils import ModelEmaV3
from torch import nn

from lowalt.recognition.flat_weights import laid_out, wholes


class MovingAverage(ModelEmaV3):
    """`ModelEmaV3` of one model. Listing all weights by name at every step took longer than averaging them."""

    def __init__(self, model: nn.Module, decay: float) -> None:
        """model: whose weights are averaged, moved in place only; decay: weight of the old average, 0..1.

        The model's buffers are laid end to end (`flat_weights.laid_out`), so that they are averaged as one.
        """
        # Running means of batch norms and the like: an optimiser lays out weights, and these are none.
        others = [value for value in model.buffers() if value.dtype == torch.float32]
        if others:
            laid_out(others)
        super().__init__(model, decay=decay)
        # The module's own tensors, not those of its state, whose memory can be exchanged without the module's.
        own = dict(self.module.named_parameters(remove_duplicate=False)) | dict(self.module.named_buffers())
        pairs = [(own[name], value) for name, value in model.state_dict().items()]
        self._copied = [pair for pair in pairs if not pair[0].is_floating_point()]
        averages, weights = zip(*(pair for pair in pairs if pair[0].is_floating_point()), strict=True)
        # Weights that are laid out end to end are averaged as one, so their averages are laid out likewise.
        self._averaged = [
            (averages[numbers[0]] if len(numbers) == 1 else laid_out([averages[number] for number in numbers]), whole)
            for whole, numbers in wholes(list(weights))
        ]

    def apply_update_(self, model: nn.Module, decay: float) -> None:
        """Set every floating-point weight to decay * average + (1 - decay) * weight, and copy the others."""
        averages, weights = map(list, zip(*self._averaged, strict=True))
        self._foreach_lerp_(averages, weights, 1 - decay)
        for average, weight in self._copied:
            average.copy_(weight)
