"""What file a model's name stands for: a path, or a name of an extension's collection."""

from pathlib import Path

from lowalt.config.extensions import module_offered, offered
from lowalt.files.errors import InputError


def path_of(model: str | Path) -> Path:
    """Return the file of a model by its path or by a name that a collection has.

    The path may leave out .safetensors.
    Raises: InputError naming the models there are.
    """
    path = Path(model)
    if path.suffix or path.is_file():
        return path
    if path.with_name(f"{path.name}.safetensors").is_file():
        return path.with_name(f"{path.name}.safetensors")
    known: list[str] = []
    for collection, name_of_module in offered("models").items():
        module = module_offered("models", collection, name_of_module)
        names = module.names()
        if str(model) in names:
            return module.path_of(str(model))
        known += names
    expected = f"one, or a name among {known}" if known else "one"
    raise InputError(f"model {str(model)!r}: not a file, expected {expected}")
