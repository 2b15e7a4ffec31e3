"""The configuration of the twins: radars, receivers and scenes as one checked object, with the clouds they need."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lowalt.config.classes import CATEGORIES
from lowalt.config.layers import load_yaml, merge
from lowalt.files.errors import InputError
from lowalt.recordings.scenes import clouds_of, intervals
from lowalt.recordings.twin import Twin
from lowalt.targets.cloud import Cloud
from lowalt.targets.records import load_records


@dataclass(frozen=True)
class Library:
    """All twins of a configuration: name -> twin, its measured sets, and category -> scenes, receivers filled in."""

    seed: int
    twins: dict[str, Twin]
    sets: dict[str, list[str]]
    scenes: dict[str, dict[str, list[dict]]]
    records: dict[str, dict]
    memo: dict | None = None
    """Cache of simulated echoes, or None to keep none. Libraries that differ only in their receivers may share one."""

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

    def clouds(self, twin: str, category: str) -> dict[str, Cloud]:
        """Return the clouds of all subtypes of a twin's scenes of one category."""
        names = dict.fromkeys(name for scene in self.scenes[twin][category] for name in scene["subtypes"])
        return clouds_of(self.records, list(names), self.seed)

    def simulated(self, twin: str, category: str, count: int, purpose: str, receivers: int = 1):
        """Return simulated intervals (count, receivers, symbols) of a category, and the names of their subtypes.

        The category's scenes share the `count` intervals evenly. `purpose` keys the random streams: equal purposes give
        equal scenes.
        """
        clouds, scenes = self.clouds(twin, category), self.scenes[twin][category]
        found, names = [], []
        for number, scene in enumerate(scenes):
            share = len(range(number, count, len(scenes)))
            keys = (purpose, twin, category, number)
            signals, subtypes = intervals(self.twins[twin], scene, clouds, self.seed, keys, share, receivers, self.memo)
            found.append(signals)
            names += subtypes
        return np.concatenate(found), names

    def twin_of(self, name: str) -> str:
        """Return the twin of a measured set.

        Raises: InputError naming the sets there are.
        """
        for twin, sets in self.sets.items():
            if name in sets:
                return twin
        raise InputError(
            f"set {name!r}: no twin, expected one of {[one for sets in self.sets.values() for one in sets]}"
        )
