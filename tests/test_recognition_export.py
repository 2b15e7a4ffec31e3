"""Exported networks give the answers of the network they were made from."""

import numpy as np
import pytest
import torch

from lowalt.files.errors import InputError
from lowalt.recognition import runs
from trainings import sources


@pytest.mark.slow
def test_an_onnx_file_gives_the_same_answers_at_any_batch_size(trained, views, tmp_path):
    pytest.importorskip("onnxscript")
    onnxruntime = pytest.importorskip("onnxruntime")
    from lowalt.recognition.export import export

    model = runs.load(trained / "model.pt")
    export(model, tmp_path / "model.onnx")
    session = onnxruntime.InferenceSession(str(tmp_path / "model.onnx"), providers=["CPUExecutionProvider"])
    source = sources(views)["validation"]
    for count in (1, 5):
        index = source.views(np.arange(count))
        with torch.inference_mode():
            expected = model.model(torch.from_numpy(index)).softmax(1).numpy()
        (found,) = session.run(None, {session.get_inputs()[0].name: index})
        np.testing.assert_allclose(found, expected, atol=1e-5)


def test_an_exported_program_gives_the_same_answers_at_any_batch_size(trained, views, tmp_path):
    from lowalt.recognition.export import export

    model = runs.load(trained / "model.pt")
    export(model, tmp_path / "model.pt2")
    program = torch.export.load(tmp_path / "model.pt2").module()
    source = sources(views)["validation"]
    for count in (1, 5):
        index = torch.from_numpy(source.views(np.arange(count)))
        with torch.inference_mode():
            torch.testing.assert_close(program(index), model.model(index).softmax(1), atol=1e-6, rtol=1e-5)
    with pytest.raises(InputError, match="pt2 or"):
        export(model, tmp_path / "model.bin")
