"""What a trained model says of a recording, for `lowalt predict`."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lowalt.extensions.recordings.record import Record, read_record
from lowalt.machine.progress import announced

if TYPE_CHECKING:
    from lowalt.recognition.runs import Trained


def read(path: Path) -> Record:
    """Return the record of a recording. Raises: InputError as `read_record`."""
    return read_record(path)


def answer(model: "Trained", settings: dict, record: Record, name: str) -> tuple[list[dict], str]:
    """Return the class of every window of a recording, as facts and in one line each, with counts
    of the classes.

    settings: how the model's images were made; name: the record's file, for messages.
    Raises: InputError for a model of images that the recording does not give.
    """
    # The network's libraries take seconds to import.
    from lowalt.extensions.recordings.answers import answers

    with announced("lowalt predict: reading the recording and answering"):
        heard = answers(model, settings, record, name)
    outcomes = heard.outcomes(list(model.classes))
    names = np.array(model.classes)[heard.probabilities.argmax(1)]
    windows = []
    lines = []
    for number, outcome in enumerate(outcomes):
        start_s = float(heard.starts_s[number])
        beyond_mps = float(heard.beyond_mps[number])
        window = {
            "start_s": start_s,
            "target": bool(heard.present[number]),
            "clipped": bool(heard.clipped[number]),
            "lost": bool(heard.lost[number]),
            "beyond_mps": None if np.isnan(beyond_mps) else beyond_mps,
            "class": str(names[number]),
        }
        shares = heard.probabilities[number].tolist()
        windows.append(window | dict(zip(model.classes, shares, strict=True)))
        lines.append(f"{start_s:8.2f} s  {heard.words(number, outcome)}")
    counts = [f"{category} {outcomes.count(category)}" for category in model.classes]
    last = f"{heard.present.sum()} of {len(names)} windows hold a target: {', '.join(counts)}"
    if not heard.present.any():
        last = (
            f"nothing there: none of {len(names)} windows holds a target that this network could"
            " know"
        )
    notes = [f"note: {note}" for note in heard.notes]
    return windows, "\n".join([*lines, last, *notes])
