"""Weights laid end to end: values, layouts, steps, averages and states are those of weights one by one."""

import copy

import pytest
import torch
from torch import nn

from lowalt.recognition.flat_weights import FlatAdamW, laid_out, wholes
from lowalt.recognition.moving_average import MovingAverage

SETTINGS = {"lr": 0.01, "fused": True}


@pytest.fixture(autouse=True)
def one_thread():
    """Sums in one order, as in the default's trainings."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def network():
    """A network with a weight in channels-last order, a batch norm, and a linear layer."""
    torch.manual_seed(5)
    layers = nn.Sequential(nn.Conv2d(3, 4, 3, bias=False), nn.BatchNorm2d(4), nn.ReLU(), nn.Flatten(), nn.Linear(16, 2))
    return layers.to(memory_format=torch.channels_last)


def groups(model):
    """Weights of two groups: matrices, which decay, and the rest."""
    every = list(model.parameters())
    return [
        {"params": [value for value in every if value.ndim > 1], "weight_decay": 0.3},
        {"params": [value for value in every if value.ndim == 1], "weight_decay": 0.0},
    ]


def take_steps(model, optimiser, count, first=0):
    for step in range(first, first + count):
        torch.manual_seed(100 + step)
        model(torch.randn(6, 3, 4, 4)).square().sum().backward()
        optimiser.step()
        optimiser.zero_grad(set_to_none=True)


def same(first, second):
    left, right = first.state_dict(), second.state_dict()
    # AdamW rounds the last elements of a tensor, which fill no vector instruction, otherwise than the others.
    return all(torch.allclose(value, right[name], rtol=1e-5, atol=1e-7) for name, value in left.items())


def test_tensors_keep_values_shapes_and_layouts_and_share_their_memory_with_the_whole():
    model = network()
    before, strides = copy.deepcopy(model), [value.stride() for value in model.parameters()]
    whole = laid_out(list(model.parameters()))
    assert same(model, before) and [value.stride() for value in model.parameters()] == strides
    assert strides[0] == (27, 1, 9, 3), "the convolution's weights lie in channels-last order"
    assert [value.numel() for value in model.parameters()] == [108, 4, 4, 32, 2] and whole.shape == (192,)
    assert [value.storage_offset() for value in model.parameters()] == [0, 112, 128, 144, 176]
    assert (whole[108:112] == 0).all()
    whole += 1
    assert torch.equal(model[0].weight, before[0].weight + 1) and torch.equal(model[4].bias, before[4].bias + 1)


def test_steps_are_those_on_weights_one_by_one():
    plain, flat = network(), network()
    one_by_one, whole = torch.optim.AdamW(groups(plain), **SETTINGS), FlatAdamW(groups(flat), **SETTINGS)
    start = copy.deepcopy(flat)
    take_steps(plain, one_by_one, 4)
    take_steps(flat, whole, 4)
    assert same(plain, flat) and not same(flat, start)
    assert [len(group["params"]) for group in whole.param_groups] == [1, 1]
    norm = nn.utils.clip_grad_norm_([value for group in whole.param_groups for value in group["params"]], 1.0)
    assert norm == 0, "gradients are zeroed after a step"


@pytest.mark.parametrize(("before", "after"), [("flat", "plain"), ("plain", "flat"), ("flat", "flat")])
def test_a_state_goes_on_in_either_form(before, after):
    kinds = {"flat": FlatAdamW, "plain": torch.optim.AdamW}
    through, stopped = network(), network()
    take_steps(through, torch.optim.AdamW(groups(through), **SETTINGS), 5)
    first = kinds[before](groups(stopped), **SETTINGS)
    take_steps(stopped, first, 3)
    weights, state = copy.deepcopy(stopped.state_dict()), copy.deepcopy(first.state_dict())
    assert [len(group["params"]) for group in state["param_groups"]] == [2, 3]
    resumed = network()
    second = kinds[after](groups(resumed), **SETTINGS)
    resumed.load_state_dict(weights)
    second.load_state_dict(state)
    take_steps(resumed, second, 2, first=3)
    assert same(resumed, through)


def test_a_state_before_the_first_step_is_empty_and_taken_up():
    flat = FlatAdamW(groups(network()), **SETTINGS)
    state = flat.state_dict()
    assert state["state"] == {}
    flat.load_state_dict(state)


def test_averages_of_weights_laid_end_to_end_are_those_of_weights_one_by_one():
    plain, flat = network(), network()
    one_by_one, whole = torch.optim.AdamW(groups(plain), **SETTINGS), FlatAdamW(groups(flat), **SETTINGS)
    averages = MovingAverage(plain, 0.5), MovingAverage(flat, 0.5)
    for step in range(3):
        take_steps(plain, one_by_one, 1, step)
        take_steps(flat, whole, 1, step)
        averages[0].update(plain)
        averages[1].update(flat)
    assert same(averages[0].module, averages[1].module) and not same(averages[1].module, flat)
    assert len(averages[0]._averaged) == 6 and len(averages[1]._averaged) == 3


def test_parts_of_a_whole_are_told_from_tensors_of_their_own():
    first, second, alone, half = (torch.arange(4.0) + number for number in range(4))
    laid_out([first, second])
    found = wholes([second, alone, first])
    assert [numbers for _, numbers in found] == [[2, 0], [1]]
    assert torch.equal(found[0][0].view(2, 16)[:, :4], torch.tensor([[0.0, 1, 2, 3], [1, 2, 3, 4]]))
    assert torch.equal(found[1][0], alone)
    # Where not all of the memory is asked for, no long tensor would be that of the parts alone.
    parts = [half[:2], half[3:]]
    assert [(value.tolist(), numbers) for value, numbers in wholes(parts)] == [([3.0, 4.0], [0]), ([6.0], [1])]
