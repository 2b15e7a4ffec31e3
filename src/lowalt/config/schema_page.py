"""The page of keys: a Markdown table for each block of the configuration, written from its schema.

python -m lowalt.config.schema_page workflow/schemas/config.schema.yaml docs/reference/configuration.md
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

from lowalt.config.command import run
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml

HEAD = """\
# Keys of the configuration

Written from `workflow/schemas/config.schema.yaml` by `make docs`; do not edit it by hand. The values of the
embedded default stand in [`config/default.yaml`](../../config/default.yaml). An unknown key, a wrong type and a value
out of its range are refused before any job starts. In an overlay, null takes out what a lower layer has, such as a
station, a spectrum or an effect, wherever the key may be left out.
"""
LIMITS = {"minimum": "at least", "exclusiveMinimum": "above", "maximum": "at most", "exclusiveMaximum": "below"}


def kind(entry: dict) -> str:
    """Return the type of a key in words, such as `number or null` or its allowed words."""
    if "enum" in entry:
        return ", ".join(f"`{value}`" for value in entry["enum"])
    if "const" in entry:
        return f"`{entry['const']}`"
    if "oneOf" in entry:
        return " or ".join(kind(choice) for choice in entry["oneOf"])
    named = entry.get("type", "any")
    text = " or ".join([named] if isinstance(named, str) else named)
    if "array" in text and "items" in entry:
        text = text.replace("array", f"list of {kind(entry['items'])}")
    return text


def bounds(entry: dict) -> str:
    """Return the range of a number in words, an empty text if it has none."""
    return ", ".join(f"{word} {entry[key]:g}" for key, word in LIMITS.items() if key in entry)


def rows(entry: dict, prefix: str = "") -> Iterator[tuple[str, str, str, str]]:
    """Yield (key, type, range, meaning) of every key below an entry; keys of inner blocks are joined by dots."""
    further = entry.get("additionalProperties")
    below = dict(entry.get("properties", {}))
    if isinstance(further, dict):
        below["NAME"] = further
    for key, value in below.items():
        name = f"{prefix}{key}"
        yield name, kind(value), bounds(value), value.get("description", "")
        yield from rows(value, f"{name}.")


def cell(text: str) -> str:
    """Return a text that stands in one cell of a table."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def page(schema: dict) -> str:
    """Return the page of a schema: single keys first, then a section for each block.

    Raises: InputError where the schema has no properties.
    """
    if not schema.get("properties"):
        raise InputError("the schema has no key `properties`")
    title = "| key | type | range | meaning |\n|---|---|---|---|\n"
    single, blocks = title, ""
    for key, value in schema["properties"].items():
        lines = list(rows(value))
        if not lines:
            lines = [(key, kind(value), bounds(value), value.get("description", ""))]
        table = "".join(f"| `{name}` | {' | '.join(map(cell, rest))} |\n" for name, *rest in lines)
        if lines[0][0] == key:
            single += table
        else:
            about = cell(value.get("description", ""))
            blocks += f"\n## {key}\n\n{about[:1].upper()}{about[1:]}.\n\n{title}{table}"
    return f"{HEAD}\n{single}{blocks}"


def main(arguments: list[str]) -> None:
    """Write the page of a schema."""
    line = argparse.ArgumentParser(prog="python -m lowalt.config.schema_page", description=__doc__)
    line.add_argument("schema", type=Path, help="the configuration's schema")
    line.add_argument("page", type=Path, help="Markdown file to write")
    given = line.parse_args(arguments)
    with replacing(given.page) as temporary:
        temporary.write_text(page(load_yaml(given.schema)))


if __name__ == "__main__":
    run(main)
