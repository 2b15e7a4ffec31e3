"""Convolutions as matrix products: outputs and gradients are those of torch, in float64 and by finite differences."""

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


def both(options, shape, dtype=torch.float64):
    """torch's own layer, the same as a product, and images that fit, channels last."""
    torch.manual_seed(1)
    own = nn.Conv2d(4, 3, **{"bias": False} | options).to(dtype, memory_format=torch.channels_last)
    images = torch.randn(5, 4, *shape, dtype=dtype).contiguous(memory_format=torch.channels_last)
    return own, as_products(copy.deepcopy(own)), images.requires_grad_()


@pytest.mark.parametrize(("options", "shape"), ONE_PIXEL + POINTWISE + OTHERS)
def test_outputs_and_gradients_are_those_of_the_convolution(options, shape):
    own, product, images = both(options, shape)
    assert type(product) is MatrixProduct
    found, expected = product(images), own(images)
    assert found.shape == expected.shape
    torch.testing.assert_close(found, expected, rtol=1e-12, atol=1e-12)
    gradient = torch.randn_like(expected)
    ours = torch.autograd.grad(found, [images, *product.parameters()], gradient)
    theirs = torch.autograd.grad(expected, [images, *own.parameters()], gradient)
    for one, other in zip(ours, theirs, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("options", "shape"), ONE_PIXEL)
def test_an_output_of_one_pixel_is_no_convolution_any_more_and_passes_finite_differences(options, shape, monkeypatch):
    _, product, images = both(options, shape)

    def refused(*_):
        raise AssertionError("a convolution")

    monkeypatch.setattr(nn.Conv2d, "forward", refused)
    assert product(images).shape[2:] == (1, 1)
    assert torch.autograd.gradcheck(lambda seen: product(seen), images)


def test_images_that_need_no_gradient_get_none():
    _, product, images = both(*ONE_PIXEL[0])
    product(images.detach()).sum().backward()
    assert images.grad is None and product.weight.grad.abs().sum() > 0


def test_a_backbone_keeps_its_weights_names_and_results_and_draws_nothing():
    torch.manual_seed(2)
    own = timm.create_model("test_resnet", num_classes=0).to(memory_format=torch.channels_last)
    state = torch.get_rng_state()
    product = as_products(copy.deepcopy(own))
    assert torch.equal(torch.get_rng_state(), state)
    assert all(torch.equal(value, product.state_dict()[name]) for name, value in own.state_dict().items())
    images = torch.randn(16, 3, 24, 24)
    found, expected = product(images), own(images)
    torch.testing.assert_close(found, expected, rtol=1e-4, atol=1e-5)
    gradient = torch.randn_like(expected)
    found.backward(gradient)
    expected.backward(gradient)
    other = dict(own.named_parameters())
    for name, value in product.named_parameters():
        torch.testing.assert_close(value.grad, other[name].grad, rtol=1e-3, atol=1e-4 * other[name].grad.abs().max())


def test_grouped_dilated_and_otherwise_padded_convolutions_stay_as_they_are():
    layers = [
        nn.Conv2d(4, 4, 1, groups=2), nn.Conv2d(4, 4, 3, dilation=2), nn.Conv2d(4, 4, 3, padding="same"),
        nn.Conv2d(4, 4, 3, padding=1, padding_mode="reflect"),
    ]  # fmt: skip
    assert {type(layer) for layer in as_products(nn.Sequential(*layers))} == {nn.Conv2d}
