"""Batch norm over ranks (`lowalt.recognition.batch_norm`): one rank is torch's own layer, two are one of both."""

import copy

import pytest
import timm
import torch
from torch import nn

from lowalt.recognition import batch_norm
from lowalt.recognition.batch_norm import over_ranks


@pytest.fixture
def ranks(monkeypatch):
    """Stands for so many ranks with the same images: a sum over them is that many times each one's."""
    found = {"count": 1}
    monkeypatch.setattr(batch_norm.distributed, "all_reduce", lambda values: values.mul_(found["count"]))
    return found


def layer():
    """A layer with weights, running means and settings of its own."""
    torch.manual_seed(4)
    own = nn.BatchNorm2d(3, eps=1e-2, momentum=0.3)
    for value in (own.weight, own.bias, own.running_mean):
        nn.init.normal_(value)
    own.running_var.uniform_(0.5, 2)
    return own


@pytest.mark.parametrize("count", [1, 2])
def test_a_step_of_all_ranks_is_that_of_one_with_the_whole_batch(ranks, count):
    ranks["count"] = count
    own = layer()
    shared = over_ranks(nn.Sequential(copy.deepcopy(own)))[0]
    assert type(shared) is batch_norm.BatchNormOverRanks and (shared.eps, shared.momentum) == (1e-2, 0.3)
    images = (5 + torch.randn(2, 3, 4, 5)).requires_grad_()
    both = torch.cat([images.detach()] * count).requires_grad_()
    wanted, found = own(both), shared(images)
    torch.testing.assert_close(found, wanted[:2], rtol=1e-4, atol=1e-4)
    assert found.dtype == images.dtype and found.is_contiguous(memory_format=torch.channels_last)
    gradient = torch.randn_like(found)
    found.backward(gradient)
    wanted.backward(torch.cat([gradient] * count))
    torch.testing.assert_close(images.grad, both.grad[:2], rtol=1e-3, atol=1e-4)
    for name in ("running_mean", "running_var", "num_batches_tracked"):
        torch.testing.assert_close(getattr(shared, name), getattr(own, name), rtol=1e-4, atol=1e-5)
    before = shared.running_mean.clone()
    torch.testing.assert_close(shared.eval()(both), own.eval()(both), rtol=1e-4, atol=1e-4)
    assert torch.equal(shared.running_mean, before) and shared.num_batches_tracked == 1


def test_every_batch_norm_of_a_backbone_is_replaced_with_its_activation(ranks):
    torch.manual_seed(5)
    own = timm.create_model("test_efficientnet", num_classes=0).train()
    shared = over_ranks(copy.deepcopy(own))
    counts = [sum(isinstance(one, nn.BatchNorm2d) for one in model.modules()) for model in (own, shared)]
    assert counts[0] == counts[1] == sum(type(one) is batch_norm.BatchNormOverRanks for one in shared.modules()) > 3
    images = torch.randn(4, 3, 32, 32)
    torch.testing.assert_close(shared(images), own(images), rtol=1e-3, atol=1e-3)
    assert shared.state_dict().keys() == own.state_dict().keys()
