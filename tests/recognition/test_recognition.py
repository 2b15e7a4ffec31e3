"""The network: token layout, pooling, palettes, parameter counts, on small timm backbones and one
of the user's own.
"""

from pathlib import Path

import numpy as np
import pytest
import torch

from lowalt.files.errors import InputError
from lowalt.recognition import fusion as fusion_of
from lowalt.recognition import own_backbone, recogniser, schemes

BLOCK = {
    "backbone": "test_vit2",
    "weights": "none",
    "intra_depth": 1,
    "inter_depth": 1,
    "heads": 4,
    "feed_forward": 2,
    "dropout": 0.0,
    "hidden": 0,
}
SIZE = 32
PALETTES = np.stack(
    [np.arange(256)[:, None] * [1, 0.5, 0.25] + shift for shift in (0, 0, 0)]
).astype(np.uint8)

GOOD = """
import torch
from torch import nn

def small(size):
    return nn.Sequential(nn.Conv2d(3, 5, 3), nn.BatchNorm2d(5), nn.AdaptiveAvgPool2d(1), nn.Flatten())

def empty(size):
    return nn.Identity()

def broken(size):
    raise ValueError("no network today")

number = 3
"""


def small_recogniser(
    stations="ABC", spectra="VRP+TRP+VT", fusion="attention", own_backbone="", **changes
):
    torch.manual_seed(0)
    places = (
        tuple("ABC".index(name) for name in stations),
        tuple(schemes.SPECTRA.index(n) for n in spectra.split("+")),
    )
    scheme = schemes.Scheme("x", *places, fusion, own_backbone)
    return recogniser.Recogniser(scheme, {**BLOCK, **changes}, SIZE, PALETTES, 4).eval()


def images(samples, views, seed=0):
    generator = torch.Generator().manual_seed(seed)
    return torch.randint(
        0, 256, (samples, views, SIZE, SIZE), dtype=torch.uint8, generator=generator
    )


@torch.inference_mode()
@pytest.mark.parametrize(
    ("stations", "spectra"), [("A", "VT"), ("B", "VRP+TRP+VT"), ("AC", "TRP"), ("ABC", "VRP+VT")]
)
def test_tokens_are_the_backbones_features_of_each_view_in_its_place(stations, spectra):
    model = small_recogniser(stations, spectra)
    count = (len(stations), len(spectra.split("+")))
    index = images(3, count[0] * count[1])
    tokens = model.tokens(index)
    assert tokens.shape == (3, *count, model.backbone.num_features)
    mean, std = (torch.tensor(model.backbone.pretrained_cfg[key]) for key in ("mean", "std"))
    for sample in range(3):
        for station in range(count[0]):
            for spectrum in range(count[1]):
                view = index[sample, station * count[1] + spectrum]
                colour = torch.from_numpy(PALETTES[0])[view.long()] / 255
                alone = model.backbone(((colour - mean) / std).permute(2, 0, 1)[None])[0]
                torch.testing.assert_close(
                    tokens[sample, station, spectrum], alone, atol=2e-5, rtol=1e-5
                )


@torch.inference_mode()
def test_each_spectrum_is_coloured_by_its_own_palette():
    palettes = np.stack([np.full((256, 3), value, np.uint8) for value in (10, 20, 30)])
    layer = recogniser.Palettes(palettes, (0, 2), (0.0,) * 3, (1.0,) * 3)
    colours = layer(images(2, 4).unflatten(1, (2, 2)))
    assert colours.shape == (2, 2, 2, 3, SIZE, SIZE)
    assert torch.allclose(colours[:, :, 0], torch.tensor(10 / 255))
    assert torch.allclose(colours[:, :, 1], torch.tensor(30 / 255))


@pytest.mark.parametrize("shape", [(2, 256, 3), (1, 256, 3), (3, 255, 3), (3, 256, 4), (3, 256)])
def test_palettes_that_leave_a_spectrum_without_colours_are_refused(shape):
    with pytest.raises(InputError, match="palettes"):
        recogniser.Palettes(np.zeros(shape, np.uint8), (0, 2), (0.0,) * 3, (1.0,) * 3)


@torch.inference_mode()
def test_pooling_is_mean_within_a_station_and_max_between_stations():
    fusion = fusion_of.AttentionFusion(8, 3, {**BLOCK, "intra_depth": 0, "inter_depth": 0})
    tokens = torch.randn(5, 3, 3, 8)
    expected = (tokens + fusion.modality).mean(2).amax(1)
    torch.testing.assert_close(fusion(tokens), expected)
    torch.testing.assert_close(fusion_of.MeanFusion(8)(tokens), tokens.mean((1, 2)))


@torch.inference_mode()
def test_a_station_alone_answers_as_if_it_were_the_only_one():
    model = small_recogniser()
    index = images(4, 9)
    together, alone = model(index, alone=True)
    torch.testing.assert_close(together, model(index))
    for station in range(3):
        torch.testing.assert_close(
            alone.unflatten(0, (4, 3))[:, station],
            model(index[:, 3 * station : 3 * station + 3]),
            atol=1e-5,
            rtol=1e-4,
        )


@torch.inference_mode()
def test_samples_do_not_see_each_other():
    model = small_recogniser()
    index = images(4, 9)
    torch.testing.assert_close(model(index)[1:2], model(index[1:2]), atol=1e-5, rtol=1e-4)


def test_parameter_counts_follow_from_the_shapes():
    width = 64
    wide = 128
    layer = 4 * width * width + 4 * width + 2 * width * wide + wide + width + 4 * width
    features = small_recogniser("A", "VRP", "mean", hidden=0)
    assert features.backbone.num_features == width
    base = recogniser.parameters(features.backbone)
    linear = 4 * width + 4
    assert recogniser.parameters(features) == base + linear
    for spectra, depth in (("VRP", 1), ("VRP+TRP+VT", 1), ("VRP+TRP+VT", 3)):
        model = small_recogniser("ABC", spectra, intra_depth=depth)
        modality = (spectra.count("+") + 1) * width
        encoders = (depth + 1) * layer + 2 * 2 * width
        assert recogniser.parameters(model) == base + modality + encoders + linear
    hidden = small_recogniser("A", "VRP", "mean", hidden=16)
    assert recogniser.parameters(hidden) == base + (width + 1) * 16 + (16 + 1) * 4


@pytest.mark.parametrize(
    "name",
    ["test_resnet", "test_vit", "test_convnext", "test_efficientnet", "mobilenetv3_small_050"],
)
def test_any_kind_of_backbone_trains_a_step(name):
    model = small_recogniser("AB", "VRP+VT", backbone=name, heads=1).train()
    model(images(2, 4)).square().sum().backward()
    assert all(
        value.grad is not None and value.grad.isfinite().all() for value in model.parameters()
    )


def test_a_row_of_the_table_chooses_its_own_backbone():
    model = small_recogniser("A", "VT", "mean", "test_vit", backbone="test_resnet")
    assert type(model.backbone).__name__ == "VisionTransformer"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"backbone": "swin_giant"}, "swin_giant"),
        ({"weights": "nowhere.pth"}, "nowhere.pth"),
        ({"heads": 7}, "heads is 7"),
        ({"layers": 2}, "layers"),
    ],
)
def test_wrong_settings_are_refused_by_name(changes, words):
    with pytest.raises(InputError, match=words):
        small_recogniser(**changes)


def test_weights_come_from_a_local_file_also_at_another_size(tmp_path: Path):
    torch.manual_seed(7)
    from safetensors.torch import save_file
    from timm import create_model

    source = create_model("test_vit2", img_size=48)
    save_file(source.state_dict(), tmp_path / "weights.safetensors")
    model = small_recogniser(weights=str(tmp_path / "weights.safetensors"))
    torch.testing.assert_close(
        model.backbone.patch_embed.proj.weight, source.patch_embed.proj.weight
    )
    (tmp_path / "broken.safetensors").write_bytes(b"not weights")
    with pytest.raises(InputError, match=r"broken\.safetensors"):
        small_recogniser(weights=str(tmp_path / "broken.safetensors"))


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(GOOD)
    return tmp_path / "mine.py"


def test_only_a_python_file_with_a_function_is_one_s_own():
    assert own_backbone.file_of("folder/mine.py:small").name == "mine.py"
    assert (
        own_backbone.file_of("test_resnet") is None
        and own_backbone.file_of("hf_hub:timm/resnet18") is None
    )


def test_the_module_gives_its_features_and_learns(file):
    made = recogniser.backbone(f"{file}:small", "none", 24)
    assert (
        made.num_features == 5 and made.training and made.pretrained_cfg["std"] == (0.5, 0.5, 0.5)
    )
    assert made(torch.zeros(4, 3, 24, 24)).shape == (4, 5)
    # The trial of the module leaves no trace in its running means.
    assert float(made[1].num_batches_tracked) == 1


@pytest.mark.parametrize(
    ("name", "weights", "message"),
    [
        ("none.py:small", "none", "no file none.py"),
        ("{file}:other", "none", "no function 'other'"),
        ("{file}:number", "none", "no function 'number'"),
        ("{file}:broken", "none", "ValueError: no network today"),
        ("{file}:empty", "none", r"gives \(2, 3, 24, 24\) for two images"),
        ("{file}:small", "hub", "expected 'none'"),
        ("bad.py:small", "none", r"bad\.py:small.*SyntaxError"),
    ],
)
def test_a_module_that_cannot_be_made_is_refused_by_name(file, name, weights, message):
    file.with_name("bad.py").write_text("def small(size:\n")
    with pytest.raises(InputError, match=message):
        recogniser.backbone(name.format(file=file), weights, 24)
