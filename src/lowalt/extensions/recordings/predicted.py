"""What a trained model says of a recording, for `lowalt predict`."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lowalt.extensions.recordings.record import Record, read_record

if TYPE_CHECKING:
    from lowalt.recognition.runs import Trained


def read(path: Path) -> Record:
    """Return the record of a recording. Raises: InputError as `read_record`."""
    return read_record(path)


def answer(model: "Trained", settings: dict, record: Record, name: str) -> tuple[list[dict], str]:
    """Return the class of every window of a recording, as facts and in one line each, with counts of the classes.

    settings: how the model's images were made; name: the record's file, for messages.
    Raises: InputError for a model of images that the recording does not give.
    """
    # The network's libraries take seconds to import.
    from lowalt.extensions.recordings.answers import answers

    heard = answers(model, settings, record, name)
    names = np.array(model.classes)[heard.probabilities.argmax(1)]
    facts = zip(heard.starts_s.tolist(), heard.present.tolist(), heard.clipped.tolist(), heard.beyond_mps.tolist(),
                names, heard.probabilities.tolist(), strict=True)  # fmt: skip
    windows = [
        {"start_s": start, "target": target, "clipped": clipped, "beyond_mps": None if beyond != beyond else beyond,
         "class": str(name), **dict(zip(model.classes, shares, strict=True))}
        for start, target, clipped, beyond, name, shares in facts
    ]  # fmt: skip
    lines = [f"{start:8.2f} s  {heard.words(number, model.classes)}" for number, start in enumerate(heard.starts_s)]
    counts = [f"{category} {int((names[heard.present] == category).sum())}" for category in model.classes]
    last = f"{heard.present.sum()} of {len(names)} windows hold a target: {', '.join(counts)}"
    if not heard.present.any():
        last = f"nothing there: none of {len(names)} windows holds a target that this network could know"
    return windows, "\n".join([*lines, last, *(f"note: {note}" for note in heard.notes)])
