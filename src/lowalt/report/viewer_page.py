"""The viewer of a small configuration, whose samples are made together with the page.

It shows them without effects and with each effect that the configuration names.
"""

import warnings
from collections.abc import Iterator

from lowalt.files.errors import InputWarning
from lowalt.report import viewer
from lowalt.report.page import templates
from lowalt.shards.dataset import Dataset

MODEL = 0
"""Number of the motion model that is shown."""


def variants(config: dict) -> dict[str, dict]:
    """Return the configuration without effects, and with each of its effects alone, by name."""
    found = {viewer.WITHOUT: {**config, "effects": {}}}
    for name, settings in config["effects"].items():
        found[name] = {**config, "effects": {name: settings}}
    return found


def dataset(config: dict) -> Dataset:
    """Return the data set of a configuration, without the warnings that it gives to its makers.

    Raises: InputError as `Dataset`.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        return Dataset(config)


def viewed(effect: str, samples: Dataset) -> Iterator[viewer.ViewedSample]:
    """Yield a sample of each subtype at each SNR."""
    for number in range(len(samples)):
        if samples.place(number).model == MODEL:
            made = samples[number]
            yield viewer.ViewedSample(effect, made.record, made.image, made.signal)


def viewer_of(config: dict) -> str:
    """Return the viewer of a configuration's samples as a piece of HTML that needs no other file.

    Raises: InputError naming the key or value that is wrong.
    """
    sets = {effect: dataset(variant) for effect, variant in variants(config).items()}
    samples: list[viewer.ViewedSample] = []
    for effect, of_effect in sets.items():
        samples.extend(viewed(effect, of_effect))
    plain = sets[viewer.WITHOUT]
    groups = {name: row["unseen_protocol"] for name, row in plain.published.items()}
    sides = config["images"]["size"], config["recognition"]["size"]
    values = viewer.shown(
        samples,
        plain.maker.renderer,
        plain.clouds,
        groups,
        plain.classes,
        shares={},  # no network has classified these samples
        sides=sides,
    )
    return templates().get_template("viewer.html").render(values)
