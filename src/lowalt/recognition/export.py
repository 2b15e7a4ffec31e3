"""A trained model for others: weights, records and a card, or a format that an extension writes."""

from pathlib import Path

from lowalt.config.extensions import module_offered, offered
from lowalt.files.errors import InputError
from lowalt.recognition import model_card, model_file
from lowalt.recognition.runs import Trained

OWN = ".safetensors"


def export(trained: Trained, out: str | Path) -> None:
    """Write the model's weights and records (.safetensors) with a card (.md) next to them.

    For another suffix, the extension that offers it writes the model.
    Raises: InputError for a suffix that nobody writes, or as the extension does.
    """
    suffix = Path(out).suffix
    writers = offered("exports")
    if suffix in writers:
        module_offered("exports", suffix, writers[suffix]).export(trained, out)
        return
    if suffix != OWN:
        raise InputError(f"--out {out}: expected a name ending in {' or '.join([OWN, *writers])}")
    content = model_file.of_run(trained.path)
    model_file.write(out, content)
    rows = model_card.accuracy_rows(trained.path, trained.protocol, trained.scheme.name)
    model_card.write(out, content, rows)
