"""The moving average of a model's weights, updated at every step: `ModelEmaV3`, which lists its tensors only once."""

from timm.utils import ModelEmaV3
from torch import nn


class MovingAverage(ModelEmaV3):
    """`ModelEmaV3` of one model. Listing all weights by name at every step took longer than averaging them."""

    def __init__(self, model: nn.Module, decay: float) -> None:
        """model: whose weights are averaged, moved in place only; decay: weight of the old average, 0..1."""
        super().__init__(model, decay=decay)
        pairs = list(zip(self.module.state_dict().values(), model.state_dict().values(), strict=True))
        self._averaged = [pair for pair in pairs if pair[0].is_floating_point()]
        self._copied = [pair for pair in pairs if not pair[0].is_floating_point()]

    def apply_update_(self, model: nn.Module, decay: float) -> None:
        """Set every floating-point weight to decay * average + (1 - decay) * weight, and copy the others."""
        averages, weights = map(list, zip(*self._averaged, strict=True))
        self._foreach_lerp_(averages, weights, 1 - decay)
        for average, weight in self._copied:
            average.copy_(weight)
