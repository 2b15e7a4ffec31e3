"""Model files as tests write and change them: the text of an identity, and a state with its weights."""

import json

from lowalt.recognition import model_file


def load(path):
    """The identity of a model file as text, and its settings with `weights`."""
    content = model_file.read(path)
    return json.dumps(content.identity), {**content.model, "weights": model_file.restored(content.tensors)}


def save(path, identity, state):
    """Write a model file without records of its run."""
    settings = {name: value for name, value in state.items() if name != "weights"}
    tensors = {name: value.contiguous() for name, value in state["weights"].items()}
    model_file.write(path, model_file.ModelFile(tensors, json.loads(identity), settings, {}, {}))
