"""Voting and concatenation next to the paper's fusions, and the audio-spectrogram transformer's patches."""

import pytest
import torch
from torch import nn

from lowalt.common.errors import InputError
from lowalt.recognition import network, spectrogram_transformer
from lowalt.recognition.fusion import AttentionFusion, ConcatenationFusion, Fusion, VotingFusion
from lowalt.recognition.schemes import FUSIONS
from test_recognition import images, recogniser


@torch.inference_mode()
def test_voting_averages_the_probabilities_of_all_views():
    classifier, tokens = nn.Linear(8, 4), torch.randn(5, 3, 2, 8)
    found = VotingFusion(8).decided(tokens, classifier)
    torch.testing.assert_close(found.exp(), classifier(tokens).softmax(-1).mean((1, 2)))
    # Three undecided views cannot outvote a decided one.
    tokens = torch.tensor([[[[9.0, 0.0], [0.1, 0.2]], [[0.1, 0.2], [0.1, 0.2]]]])
    assert VotingFusion(2).decided(tokens, nn.Identity()).argmax() == 0


@torch.inference_mode()
def test_concatenation_keeps_every_view_in_its_place_and_one_station_alone_in_its_own():
    fusion, tokens = ConcatenationFusion(8, 3, 2), torch.randn(5, 3, 2, 8)
    assert fusion.width == 48
    torch.testing.assert_close(fusion(tokens)[:, 16:32], tokens[:, 1].flatten(1))
    alone = fusion.each_station(tokens).unflatten(0, (5, 3))
    torch.testing.assert_close(alone[:, 2, 2], tokens[:, 2])
    assert not alone[:, 2, :2].any()
    torch.testing.assert_close(alone.sum(1), tokens)


@pytest.mark.parametrize("fusion", FUSIONS)
def test_every_fusion_learns_from_all_stations_and_from_each_alone(fusion):
    model = recogniser(fusion=fusion)
    together, alone = model(images(2, 9), alone=True)
    assert together.shape == (2, 4) and alone.shape == (6, 4)
    (together.sum() + alone.sum()).backward()
    assert all(value.grad is not None for value in model.parameters())


@pytest.mark.parametrize("cued", [False, True])
def test_one_pass_over_the_spectra_gives_both_decisions_of_the_attention_fusion(cued):
    """Both decisions, by the definition of each; with dropout the draws stay those of two passes."""
    model = recogniser(fusion="attention").double().train()
    fusion, classifier = model.fusion, model.classifier
    tokens = torch.randn(4, 3, 3, fusion.width, dtype=torch.float64, requires_grad=True)
    cue = torch.randn(4, 3, fusion.width, dtype=torch.float64) if cued else None
    layers = [layer for layer in fusion.modules() if isinstance(layer, nn.TransformerEncoderLayer)]
    calls = []
    for layer in layers:
        layer.register_forward_pre_hook(lambda layer, _: calls.append(layer))

    def decided(both):
        calls.clear()
        torch.manual_seed(5)
        found = both(fusion, tokens, classifier, cue)
        return [
            *found,
            *torch.autograd.grad(sum((k + 1) * value.square().sum() for k, value in enumerate(found)), tokens),
        ]

    for dropout, passes in ((False, 3), (True, 4)):
        fusion.draws = dropout
        for layer in layers:
            layer.dropout.p = layer.dropout1.p = layer.dropout2.p = layer.self_attn.dropout = 0.3 * dropout
        found, ran = decided(type(fusion).both), len(calls)
        expected = decided(Fusion.both)
        assert ran == passes and len(calls) == 4
        torch.testing.assert_close(found, expected, rtol=1e-10, atol=1e-12)


@torch.inference_mode()
def test_patches_overlap_and_every_one_sees_its_own_pixels():
    layer = spectrogram_transformer.OverlappingPatches(24, 6, 3, 8, stride=3)
    image = torch.randn(1, 3, 24, 24)
    before = layer(image)
    assert before.shape == (1, 49, 8) and layer.num_patches == 49
    # Pixel (3, 3) lies in the patches that begin at rows and columns 0 and 3.
    image[0, :, 3, 3] += 1
    changed = (layer(image) != before).any(-1)[0].nonzero().flatten().tolist()
    assert changed == [0, 1, 7, 8]


@torch.inference_mode()
def test_the_audio_spectrogram_transformer_is_a_backbone_and_the_published_one_has_its_size():
    model = recogniser(backbone="ast_micro")
    assert model(images(2, 9)).shape == (2, 4)
    with torch.device("meta"):
        base = spectrogram_transformer.backbone("ast_base", 224)
    # The paper's own count, 87 million, is of one channel and 1212 patches; ours has 21 x 21.
    assert base.patch_embed.num_patches == 441
    assert network.parameters(base) == pytest.approx(86e6, rel=0.01)
    with pytest.raises(InputError, match=r"ast_micro.*expected 'none'"):
        recogniser(backbone="ast_micro", weights="hub")
    with pytest.raises(InputError, match="at 4 pixels, expected at least 6"):
        spectrogram_transformer.backbone("ast_micro", 4)


def test_attention_draws_random_numbers_only_where_it_drops_out():
    block = {"heads": 2, "feed_forward": 2, "intra_depth": 1, "inter_depth": 1}
    for dropout in (0.0, 0.1):
        assert AttentionFusion(8, 3, {**block, "dropout": dropout}).draws == (dropout > 0)
