"""Strict reader of YAML files (configuration, records): a mapping without duplicate keys."""

import itertools
from pathlib import Path

import yaml

from lowalt.files.atomic import text_of
from lowalt.files.errors import InputError, in_one_line


class _UniqueKeys:
    """Safe YAML loader that refuses duplicate keys; `name` is the file's name in messages."""

    name: str

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        """Return the mapping as the library does.

        Raises: InputError naming the line where a key stands twice.
        """
        # A list, not a set: for a key that cannot be hashed, YAML has its own message.
        seen = []
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)  # type: ignore[attr-defined]
            if key in seen:
                raise InputError(
                    f"{self.name}: key {key!r} stands twice (line {key_node.start_mark.line + 1})"
                )
            seen.append(key)
        return super().construct_mapping(node, deep)  # type: ignore[misc]


class _Loader(_UniqueKeys, yaml.SafeLoader):
    """PyYAML's parser in Python, which raises an error for values that are nested too deeply."""


class _FastLoader(_UniqueKeys, getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """libyaml's parser, which is seven times as fast.

    It is recursive, so a million nesting levels would crash the process.
    """


DEEPEST = 10_000
"""The Python parser reads a text in which more characters than this can open a nesting level."""

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


def load_yaml(path: str | Path, what: str = "configuration", holds: str = "keys") -> dict:
    """Return the mapping in a YAML file.

    what, holds: the file and its entries in words, for messages. Raises: InputError naming the file
    where it is missing, not YAML, no mapping, a template, or has a key twice.
    """
    text = text_of(path, what)
    try:
        levels = sum(map(text.count, "[{-:?"))
        loader = (_Loader if levels > DEEPEST else _FastLoader)(text)
        loader.name = str(path)
        root = loader.get_single_node()
        _check_size(root, path)
        value = None if root is None else loader.construct_document(root)
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
    if not isinstance(value, dict):
        raise InputError(f"{path}: {type(value).__name__}, expected a mapping of {holds}")
    if TEMPLATE in value:
        raise InputError(
            f"{path}: key {TEMPLATE!r} makes Snakemake run code in it, expected a plain document"
        )
    return value
