"""Strict reader of YAML files (configuration, records): a mapping without duplicate keys."""

import itertools
from collections.abc import Hashable
from pathlib import Path

import yaml

from lowalt.files.atomic import text_of
from lowalt.files.errors import InputError, in_one_line
from lowalt.files.json_objects import MOST_BITS


class _UniqueKeys:
    """Safe YAML loader that refuses duplicate keys; `name` is the file's name in messages."""

    name: str

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        """Return the mapping as the library does.

        Raises: InputError naming the line where a key stands twice.
        """
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)  # type: ignore[attr-defined]
            # For a key that cannot be hashed, YAML has its own message.
            if not isinstance(key, Hashable):
                continue
            if key in seen:
                raise InputError(
                    f"{self.name}: key {key!r} stands twice (line {key_node.start_mark.line + 1})"
                )
            seen.add(key)
        return super().construct_mapping(node, deep)  # type: ignore[misc]

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        """Return the whole number as the library does.

        Raises: ValueError for one of more than MOST_BITS bits, and for more characters than such a
        number has: parts in base 60 make a number that takes minutes.
        """
        value = 0
        fits = len(node.value) <= 2 * MOST_BITS
        if fits:
            value = super().construct_yaml_int(node)  # type: ignore[misc]
        if not fits or value.bit_length() > MOST_BITS:
            raise ValueError(
                f"{node.value[:20]!r}, {len(node.value)} characters, expected a whole number of at "
                f"most {MOST_BITS} bits"
            )
        return value


class _Loader(_UniqueKeys, yaml.SafeLoader):
    """PyYAML's parser in Python, which raises an error for values that are nested too deeply."""


class _FastLoader(_UniqueKeys, getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """libyaml's parser, which is seven times as fast.

    It is recursive, so a million nesting levels would crash the process.
    """


for _kind in (_Loader, _FastLoader):
    _kind.add_constructor("tag:yaml.org,2002:int", _kind.construct_yaml_int)  # type: ignore[type-var]


DEEPEST = 10_000
"""Limit on nesting levels; a text that may have more of them is read by the Python parser."""

MOST_YAML_BYTES = 4 << 20
"""Largest size of a file: its parser takes up to two hundred times as much memory."""
MOST_ENTRIES = 200_000
"""Largest number of lines and commas of a file, which bounds its values before they are made."""
MOST_NODES = 1_000_000
"""Limit on the values of a file after the expansion of anchors: ten lines can make billions."""

TEMPLATE = "__use_yte__"
"""The key that asks Snakemake's reader to run the Python expressions in a configuration."""


def _check_size(root: yaml.Node | None, path: str | Path) -> None:
    """Refuse anchors that make more than MOST_NODES values, or a value that contains itself."""
    sizes: dict[int, int] = {}

    def size(node: yaml.Node | None) -> int:
        """Number of values in a node after the expansion of anchors."""
        if not isinstance(node, yaml.CollectionNode):
            return 1
        if id(node) not in sizes:
            # A node that is met inside itself is endless.
            sizes[id(node)] = MOST_NODES + 1
            inner = node.value
            if isinstance(node, yaml.MappingNode):
                inner = itertools.chain.from_iterable(node.value)
            sizes[id(node)] = 1 + sum(map(size, inner))
        return sizes[id(node)]

    if size(root) > MOST_NODES:
        raise InputError(
            f"{path}: its anchors make more than {MOST_NODES} values of it, expected a plain "
            "document"
        )


def _levels(text: str) -> int:
    """Return a number that the nesting levels of a text do not exceed.

    A level opens by a bracket, or on one line by a mark behind those before it, or deeper within a
    line by at least one column; a list may begin in the column of its key.
    """
    deepest = 0
    for line in text.splitlines():
        indent = len(line) - len(line.lstrip())
        deepest = max(deepest, 2 * indent + sum(map(line.count, "-:?")))
    return deepest + text.count("[") + text.count("{")


def _parsed(text: str, path: str | Path) -> object:
    """Return the value that a text in YAML holds.

    path: its file, for messages. Raises: as `load_yaml` for what is not YAML or too large.
    """
    try:
        loader = (_Loader if _levels(text) > DEEPEST else _FastLoader)(text)
        loader.name = str(path)
        root = loader.get_single_node()
        _check_size(root, path)
        return None if root is None else loader.construct_document(root)
    except InputError:
        raise
    # PyYAML also raises errors of its converters, such as for month 99 of a date or a number of
    # 5000 digits.
    except (yaml.YAMLError, ValueError, TypeError, AttributeError, OverflowError) as error:
        raise InputError(f"{path}: not YAML ({in_one_line(error)})") from error
    except RecursionError:
        raise InputError(
            f"{path}: mappings and lists stand in each other too deeply, expected a few levels"
        ) from None


def load_yaml(path: str | Path, what: str = "configuration", holds: str = "keys") -> dict:
    """Return the mapping in a YAML file.

    what, holds: the file and its entries in words, for messages. Raises: InputError naming the file
    where it is missing, too large, not YAML, no mapping, a template, or has a key twice.
    """
    text = text_of(path, what, MOST_YAML_BYTES)
    if text.count("\n") + text.count(",") > MOST_ENTRIES:
        raise InputError(f"{path}: over {MOST_ENTRIES} lines and commas, expected a shorter {what}")
    value = _parsed(text, path)
    if not isinstance(value, dict):
        raise InputError(f"{path}: {type(value).__name__}, expected a mapping of {holds}")
    if TEMPLATE in value:
        raise InputError(
            f"{path}: key {TEMPLATE!r} makes Snakemake run code in it, expected a plain document"
        )
    return value
