"""A trained and evaluated scheme, read back from its prediction file and the record next to it."""

import json
from pathlib import Path

from lowalt.config.classes import stated
from lowalt.files.atomic import existing
from lowalt.files.errors import InputError
from lowalt.recognition import predictions
from lowalt.recognition.predictions import Predictions
from lowalt.recognition.protocols import folds


class Evaluated:
    """One trained and evaluated scheme: its predictions and what is known of the run."""

    def __init__(self, path: str | Path) -> None:
        """path: the prediction file; the JSON file next to it holds protocol, scheme, seed and hardware.

        Raises: InputError where either is missing or the test part is empty.
        """
        side = existing(Path(path).with_suffix(".json"), "run record")
        try:
            self.about = about = json.loads(side.read_text())
            self.protocol, self.scheme, self.seed = about["protocol"], about["scheme"], about["seed"]
            self.hardware, self.trained_on = about["hardware"], about.get("trained_on", "")
            self.classes = stated(about)
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"{side}: not a run record ({error!r})") from error
        self.all = predictions.read(path, self.classes)
        self.test = self.part("test")
        if not len(self.test):
            raise InputError(f"{path}: no predictions for the test part of the {self.protocol} protocol")

    def part(self, name: str) -> Predictions:
        """Return the predictions of a part of the run's protocol."""
        return self.all.of(folds(self.protocol, name))
