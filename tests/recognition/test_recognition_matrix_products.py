"""Convolutions as matrix products: outputs and gradients are those of torch."""

import copy

import pytest
import timm
import torch
from torch import nn

from lowalt.recognition.matrix_products import MatrixProduct, as_products

ONE_PIXEL = [
    ({"kernel_size": 3, "stride": 2, "padding": 1}, (2, 2)),
    ({"kernel_size": 3, "stride": 1, "padding": 1}, (1, 1)),
    ({"kernel_size": 3, "stride": 5, "padding": 1}, (4, 3)),
    ({"kernel_size": (2, 3), "stride": 3, "padding": (0, 2), "bias": True}, (2, 1)),
    ({"kernel_size": 4, "stride": 1, "padding": 0}, (4, 4)),
]
POINTWISE = [({"kernel_size": 1, "bias": True}, (3, 5)), ({"kernel_size": 1}, (1, 1))]
OTHERS = [
    ({"kernel_size": 3, "stride": 2, "padding": 1}, (3, 2)),
    ({"kernel_size": 1, "stride": 2}, (4, 4)),
    ({"kernel_size": 1, "padding": 1, "stride": 3}, (1, 1)),
]


@pytest.mark.parametrize(("options", "shape"), ONE_PIXEL + POINTWISE + OTHERS)
def test_outputs_and_gradients_are_those_of_the_convolution(options, shape):
    torch.manual_seed(1)
    own = (
        nn.Conv2d(4, 3, **{"bias": False} | options).double().to(memory_format=torch.channels_last)
    )
    images = (
        torch.randn(5, 4, *shape)
        .double()
        .contiguous(memory_format=torch.channels_last)
        .requires_grad_()
    )
    product = as_products(copy.deepcopy(own))
    assert type(product) is MatrixProduct
    found = product(images)
    expected = own(images)
    assert found.shape == expected.shape
    torch.testing.assert_close(found, expected, rtol=1e-12, atol=1e-12)
    gradient = torch.randn_like(expected)
    ours = torch.autograd.grad(found, [images, *product.parameters()], gradient)
    theirs = torch.autograd.grad(expected, [images, *own.parameters()], gradient)
    for one, other in zip(ours, theirs, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-12, atol=1e-12)


def test_a_backbone_keeps_its_weights_names_and_results_and_draws_nothing():
    torch.manual_seed(2)
    own = timm.create_model("test_resnet", num_classes=0).to(memory_format=torch.channels_last)
    state = torch.get_rng_state()
    product = as_products(copy.deepcopy(own))
    assert torch.equal(torch.get_rng_state(), state)
    assert all(
        torch.equal(value, product.state_dict()[name]) for name, value in own.state_dict().items()
    )
    images = torch.randn(16, 3, 24, 24)
    found = product(images)
    expected = own(images)
    torch.testing.assert_close(found, expected, rtol=1e-4, atol=1e-5)
    gradient = torch.randn_like(expected)
    found.backward(gradient)
    expected.backward(gradient)
    other = dict(own.named_parameters())
    for name, value in product.named_parameters():
        torch.testing.assert_close(
            value.grad, other[name].grad, rtol=1e-3, atol=1e-4 * other[name].grad.abs().max()
        )


def test_grouped_dilated_and_otherwise_padded_convolutions_stay_as_they_are():
    layers = [
        nn.Conv2d(4, 4, 1, groups=2),
        nn.Conv2d(4, 4, 3, dilation=2),
        nn.Conv2d(4, 4, 3, padding="same"),
        nn.Conv2d(4, 4, 3, padding=1, padding_mode="reflect"),
    ]
    assert {type(layer) for layer in as_products(nn.Sequential(*layers))} == {nn.Conv2d}
