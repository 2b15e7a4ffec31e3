"""YAML files read strictly: a mapping in which every key stands once. Configuration and records share it."""

from pathlib import Path

import yaml

from lowalt.common.errors import InputError
from lowalt.common.files import existing


class _UniqueKeyLoader(yaml.SafeLoader):
    """Safe YAML in which a key given twice is an error, not a silent overwrite."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        # A list, not a set: a key that cannot be hashed is left to YAML's own message.
        seen = []
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if key in seen:
                mark = key_node.start_mark
                raise InputError(f"{mark.name}: key {key!r} stands twice (line {mark.line + 1})")
            seen.append(key)
        return super().construct_mapping(node, deep)


def load_yaml(path: str | Path, what: str = "configuration", holds: str = "keys") -> dict:
    """Return the mapping in a YAML file; `what` and `holds` name the file and its entries in messages.

    Raises: InputError naming the file where it is missing, not YAML, no mapping, or has a key twice.
    """
    with existing(path, what).open() as file:
        try:
            value = yaml.load(file, _UniqueKeyLoader)
        except yaml.YAMLError as error:
            raise InputError(f"{path}: not YAML ({error})") from error
    if not isinstance(value, dict):
        raise InputError(f"{path}: {type(value).__name__}, expected a mapping of {holds}")
    return value
