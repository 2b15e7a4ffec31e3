"""Trained models as ONNX files."""

import numpy as np
import pytest
import torch

from lowalt.recognition import runs
from lowalt.recognition.export import export
from trainings import sources


@pytest.mark.slow
def test_an_onnx_file_gives_the_same_answers_at_any_batch_size(trained, views, tmp_path):
    pytest.importorskip("onnxscript")
    onnxruntime = pytest.importorskip("onnxruntime")
    model = runs.load(trained / "model.safetensors")
    export(model, tmp_path / "model.onnx")
    session = onnxruntime.InferenceSession(
        str(tmp_path / "model.onnx"), providers=["CPUExecutionProvider"]
    )
    source = sources(views)["validation"]
    for count in (1, 5):
        index = source.views(np.arange(count))
        with torch.inference_mode():
            expected = model.model(torch.from_numpy(index)).softmax(1).numpy()
        (found,) = session.run(None, {session.get_inputs()[0].name: index})
        np.testing.assert_allclose(found, expected, atol=1e-5)
