"""The configuration of the twins: radars, receivers and scenes as one checked object, with the clouds they need."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lowalt.config.classes import CATEGORIES
from lowalt.config.layers import load_yaml, merge
from lowalt.files.errors import InputError
from lowalt.recordings.scenes import clouds_of, intervals
from lowalt.recordings.twin import Twin
from lowalt.targets.records import load_records


@dataclass(frozen=True)
class Library:
    """All twins of a configuration: name -> twin, its measured sets, and category -> scenes, receivers filled in."""

    seed: int
    twins: dict[str, Twin]
    sets: dict[str, list[str]]
    scenes: dict[str, dict[str, list[dict]]]
    records: dict[str, dict]

    @classmethod
    def read(cls, path: str | Path) -> "Library":
        """Return the library in a YAML file such as `config/measured/twins.yaml`.

        A file with the key `base` is merged over the file that it names, key by key; a list of scenes replaces the
        base's list.
        Raises: InputError naming the key that is missing or wrong.
        """
        block = load_yaml(path, "twins")
        if "base" in block:
            block = merge(load_yaml(block.pop("base"), "twins"), block)
        try:
            records = load_records(block["targets"]["table"], block["targets"]["records"])
            twins = {name: Twin.from_settings(twin["radar"]) for name, twin in block["twins"].items()}
            sets = {name: list(twin["sets"]) for name, twin in block["twins"].items()}
            scenes = {
                name: {
                    category: [
                        {**scene, "receiver": twin["receiver"] | scene.get("receiver", {})}
                        for scene in {**block["scenes"], **twin.get("scenes", {})}[category]
                    ]
                    for category in CATEGORIES
                }
                for name, twin in block["twins"].items()
            }
            return cls(int(block["seed"]), twins, sets, scenes, records)
        except KeyError as error:
            raise InputError(f"{path}: key {error} is missing") from None

    def simulated(self, twin: str, category: str, count: int, purpose: str, receivers: int = 1):
        """Return simulated intervals (count, receivers, symbols) of a category, and the names of their subtypes.

        The category's scenes share the `count` intervals evenly. `purpose` keys the random streams: equal purposes give
        equal scenes.
        """
        scenes = self.scenes[twin][category]
        subtypes_of_all = dict.fromkeys(name for scene in scenes for name in scene["subtypes"])
        clouds = clouds_of(self.records, list(subtypes_of_all), self.seed)
        parts, names = [], []
        for number, scene in enumerate(scenes):
            share = len(range(number, count, len(scenes)))
            keys = (purpose, twin, category, number)
            signals, subtypes = intervals(self.twins[twin], scene, clouds, self.seed, keys, share, receivers)
            parts.append(signals)
            names += subtypes
        return np.concatenate(parts), names
