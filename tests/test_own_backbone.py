"""A backbone of the user's own file: it becomes part of the network, and a wrong file is refused by name."""

import pytest
import torch

from lowalt.files.errors import InputError
from lowalt.recognition import network, own_backbone

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


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(GOOD)
    return tmp_path / "mine.py"


def test_only_a_python_file_with_a_function_is_one_s_own():
    assert own_backbone.file_of("folder/mine.py:small").name == "mine.py"
    assert own_backbone.file_of("test_resnet") is None and own_backbone.file_of("hf_hub:timm/resnet18") is None


def test_the_module_gives_its_features_and_learns(file):
    made = network.backbone(f"{file}:small", "none", 24)
    assert made.num_features == 5 and made.training and made.pretrained_cfg["std"] == (0.5, 0.5, 0.5)
    assert made(torch.zeros(4, 3, 24, 24)).shape == (4, 5)
    # The trial of the module leaves no trace in its running means.
    assert float(made[1].num_batches_tracked) == 1


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("none.py:small", "no file none.py"),
        ("{file}:other", "no function 'other'"),
        ("{file}:number", "no function 'number'"),
        ("{file}:broken", "ValueError: no network today"),
        ("{file}:empty", r"gives \(2, 3, 24, 24\) for two images"),
    ],
)
def test_a_wrong_name_is_refused(file, name, message):
    with pytest.raises(InputError, match=message):
        network.backbone(name.format(file=file), "none", 24)


def test_weights_of_a_library_do_not_fit_a_module_of_one_s_own(file):
    with pytest.raises(InputError, match="expected 'none'"):
        network.backbone(f"{file}:small", "hub", 24)


def test_a_file_with_a_fault_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.py").write_text("def small(size:\n")
    with pytest.raises(InputError, match=r"bad\.py:small.*SyntaxError"):
        network.backbone(f"{tmp_path}/bad.py:small", "none", 24)
