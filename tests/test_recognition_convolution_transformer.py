"""The transformer behind depthwise convolutions: its tokens, its place in the network, and its refusals."""

import pytest
import torch
from test_recognition_fusion import images, recogniser

from lowalt.common.errors import InputError
from lowalt.recognition import convolution_transformer


@torch.inference_mode()
def test_tokens_are_four_pixels_apart_and_each_sees_its_neighbourhood_alone():
    layer = convolution_transformer.ConvolutionTokens(24, 3, 8).eval()
    image = torch.zeros(1, 3, 24, 24)
    before = layer(image)
    assert before.shape == (1, 36, 8) and layer.num_patches == 36 and layer.feat_ratio() == 4
    image[0, :, 0, 0] += 1
    changed = (layer(image) != before).any(-1)[0].nonzero().flatten().tolist()
    assert changed == [0, 1, 6, 7]
    assert convolution_transformer.ConvolutionTokens(25, 3, 8)(torch.zeros(1, 3, 25, 25)).shape == (1, 49, 8)


@torch.inference_mode()
def test_it_is_a_backbone_of_the_network_and_starts_without_weights():
    assert recogniser(backbone="dc_former_micro")(images(2, 9)).shape == (2, 4)
    with pytest.raises(InputError, match=r"dc_former_micro.*expected 'none'"):
        recogniser(backbone="dc_former_micro", weights="hub")
    with pytest.raises(InputError, match="at 7 pixels, expected at least 8"):
        convolution_transformer.backbone("dc_former_micro", 7)
