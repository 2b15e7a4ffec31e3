"""The weights of a network laid end to end in a few long tensors, for steps that treat every element alike.

On a processor, an optimiser, an average or a norm spends microseconds on each tensor, whatever its size: with the 77
weights of the default's network that was a tenth of a training step.
"""

from typing import Any

import torch
from torch import nn

ALIGNED = 16
"""Every tensor begins at a multiple of so many elements, where vector instructions read fastest; the gaps are zero."""


def _room(tensor: torch.Tensor) -> int:
    """Return the elements that a tensor takes in a long one, its gap included."""
    return -(-tensor.numel() // ALIGNED) * ALIGNED


def _parts(flat: torch.Tensor, tensors: list[torch.Tensor]) -> list[torch.Tensor]:
    """Return a long tensor's parts, one after the other, in the shapes and dense memory layouts of other tensors."""
    found, at = [], 0
    for tensor in tensors:
        found.append(torch.as_strided(flat.detach(), tensor.shape, torch.empty_like(tensor).stride(), at))
        at += _room(tensor)
    return found


def laid_out(tensors: list[torch.Tensor]) -> torch.Tensor:
    """Lay tensors of one type in one long tensor and return it, (elements,); each becomes a part of it.

    Values, shapes and memory layouts stay; the tensors' objects stay too, so a network goes on with the same weights.
    """
    flat = tensors[0].new_zeros(sum(map(_room, tensors)))
    for tensor, part in zip(tensors, _parts(flat, tensors), strict=True):
        part.copy_(tensor.detach())
        tensor.data = part
    return flat


def wholes(tensors: list[torch.Tensor]) -> list[tuple[torch.Tensor, list[int]]]:
    """Return the long tensors that tensors are laid out in, each with the numbers of its parts, from end to end.

    A tensor that is not laid out with all others of its memory is its own whole.
    """
    found: dict[int, list[int]] = {}
    for number, tensor in enumerate(tensors):
        found.setdefault(tensor.untyped_storage().data_ptr(), []).append(number)
    result = []
    for numbers in found.values():
        numbers.sort(key=lambda number: tensors[number].storage_offset())
        first = tensors[numbers[0]].detach()
        elements = sum(_room(tensors[number]) for number in numbers)
        if len(numbers) > 1 and elements * first.element_size() == first.untyped_storage().nbytes():
            result.append((torch.as_strided(first, (elements,), (1,), 0), numbers))
        else:
            result += [(tensors[number].detach(), [number]) for number in numbers]
    return result


class FlatAdamW(torch.optim.AdamW):
    """`AdamW` that steps on the weights of each group as one parameter: the same steps, with other rounding.

    Gradients are zeroed in place, never dropped. The state is read and written weight by weight, as that of `AdamW`, so
    a training goes on with either.
    """

    def __init__(self, groups: list[dict], **settings: Any) -> None:
        """groups: as of `AdamW`, with lists of weights of one type; these are laid end to end here."""
        self.members = [group["params"] for group in groups]
        super().__init__([{**group, "params": [_whole(group["params"])]} for group in groups], **settings)

    def zero_grad(self, set_to_none: bool = False) -> None:
        """Set all gradients to zero. set_to_none is passed over: the gradients are parts of long tensors."""
        super().zero_grad(set_to_none=False)

    def state_dict(self) -> dict:
        """Return the state as of `AdamW` on the weights one by one; its tensors are parts of this optimiser's."""
        kept = super().state_dict()
        state, groups, number = {}, [], 0
        for group, weights in zip(kept["param_groups"], self.members, strict=True):
            values = kept["state"].get(group["params"][0], {})
            # The number of steps is a tensor of its own for each weight: `AdamW` counts in it.
            parts = {key: _parts(value, weights) if value.ndim else [value.clone() for _ in weights]
                     for key, value in values.items()}  # fmt: skip
            numbers = list(range(number, number := number + len(weights)))
            groups.append({**group, "params": numbers})
            if values:
                state |= {one: {key: parts[key][place] for key in parts} for place, one in enumerate(numbers)}
        return {"state": state, "param_groups": groups}

    def load_state_dict(self, state_dict: dict) -> None:
        """Take up a state of `AdamW` on the same weights one by one, or of this class."""
        state, groups = {}, []
        for number, group in enumerate(state_dict["param_groups"]):
            groups.append({**group, "params": [number]})
            parts = [state_dict["state"][one] for one in group["params"] if one in state_dict["state"]]
            if parts:
                of_key = {key: [part[key] for part in parts] for key in parts[0]}
                state[number] = {key: laid_out([value.clone() for value in values]) if values[0].ndim else values[0]
                                 for key, values in of_key.items()}  # fmt: skip
        super().load_state_dict({"state": state, "param_groups": groups})


def _whole(weights: list[nn.Parameter]) -> nn.Parameter:
    """Lay weights end to end and return them as one parameter (elements,), whose gradient is theirs, end to end."""
    whole = nn.Parameter(laid_out(list(weights)))
    whole.grad = torch.zeros_like(whole)
    for weight, part in zip(weights, _parts(whole.grad, weights), strict=True):
        weight.grad = part
    return whole
