"""Pages of the site's reference, Markdown made of the two schemas, of the configuration and of
targets' records, and of the modules of effects.

`docs/site_pages.py` makes them as the site is built.
"""

import inspect
from collections.abc import Iterator

from lowalt.files.errors import InputError
from lowalt.scene.effects import PLACES, module_of
from lowalt.targets.record_schema import COMMON, figures

CONFIGURATION_HEAD = """\
# Keys of the configuration

Made from `workflow/schemas/config.schema.yaml`. The values of the embedded default stand in
[`config/default.yaml`](../../config/default.yaml). An unknown key, a wrong type and a value out of its range are
refused before any job starts. In an overlay, null takes out what a lower layer has, such as a station, a spectrum or
an effect, wherever the key may be left out.
"""
LIMITS = {
    "minimum": "at least",
    "exclusiveMinimum": "above",
    "maximum": "at most",
    "exclusiveMaximum": "below",
}

RECORDS_HEAD = """\
# Keys of target records

Made from `src/lowalt/targets/records.schema.yaml`. What a record is, and how to write one:
[Records of targets](../../design/targets.md), [A target of your own](../tutorials/target.md).

"""
EFFECTS_HEAD = """\
# Effects

Made from the module of each effect: its law and the source of the law, in the order in which effects act. Parameters:
[keys of the configuration](configuration.md#effects). What a scene is: [Scenes and effects](../scenes.md).
"""

INSIDE = {
    "Parts of a mesh (`parts`, each by its name)": "part",
    "Meshes of a part (`meshes`, a list)": "mesh",
    "Regions (`region`, `drop`)": "region",
    "Wing beat (`flap`)": "flap",
}


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


def value(entry: dict) -> str:
    """Return the type of a key and the range of a number in words, such as `number, at least 0`."""
    return ", ".join(
        [kind(entry), *(f"{word} {entry[key]:g}" for key, word in LIMITS.items() if key in entry)]
    )


def rows(entry: dict, prefix: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield (key, value, meaning) of every key below an entry; keys of inner blocks are joined by
    dots.
    """
    further = entry.get("additionalProperties")
    below = dict(entry.get("properties", {}))
    if isinstance(further, dict):
        below["NAME"] = further
    for key, inner in below.items():
        name = f"{prefix}{key}"
        yield name, value(inner), inner.get("description", "")
        yield from rows(inner, f"{name}.")


def cell(text: str) -> str:
    """Return a text that stands in one cell of a table."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def configuration_page(schema: dict) -> str:
    """Return the page of the configuration's schema: single keys first, then a section for each
    block.

    Raises: InputError where the schema has no properties.
    """
    if not schema.get("properties"):
        raise InputError("the schema has no key `properties`")
    title = "| key | value | meaning |\n|---|---|---|\n"
    single = title
    blocks = ""
    for key, entry in schema["properties"].items():
        lines = list(rows(entry))
        if not lines:
            lines = [(key, value(entry), entry.get("description", ""))]
        table = "".join(
            f"| `{name}` | {' | '.join(map(cell, cells))} |\n" for name, *cells in lines
        )
        if lines[0][0] == key:
            single += table
        else:
            about = cell(entry.get("description", ""))
            blocks += f"\n## {key}\n\n{about[:1].upper()}{about[1:]}.\n\n{title}{table}"
    return f"{CONFIGURATION_HEAD}\n{single}{blocks}"


def effects_page() -> str:
    """Return the page of effects: a section for each place, with law and source of every effect."""
    lines = [EFFECTS_HEAD]
    for name, place in PLACES.items():
        title = f"## {place.capitalize()}"
        if title not in lines:
            lines += [title, ""]
        module = module_of(name)
        law = inspect.cleandoc(module.__doc__)
        source = f"{module.SOURCE[:1].upper()}{module.SOURCE[1:]}."
        lines += [f"### {name}", "", law, "", f"*Source:* {source}", ""]
    return "\n".join(lines)


def records_page(schema: dict) -> str:
    """Return the page of the keys of records: those of every record, of each source, and of what
    stands inside.

    Raises: InputError naming a key without a description.
    """
    sections = {
        "Every record" if name == COMMON else f"Source `{name}`": section
        for name, section in schema["sources"].items()
    }
    sections |= {title: schema["$defs"][name] for title, name in INSIDE.items()}
    lines = [RECORDS_HEAD]
    for title, section in sections.items():
        lines += [f"## {title}", "", "| key | meaning |", "|---|---|"]
        for name, key in section["properties"].items():
            if "description" not in key:
                raise InputError(
                    f"schema of records: {name} has no description, expected one line of meaning"
                )
            lines.append(
                f"| `{name}`{' (needed)' * (name in section.get('required', []))} |"
                f" {key['description']} |"
            )
        lines.append("")
    lines += [
        "## Built-in models (`model`)",
        "",
        "| model | like | size_is | keys | figures |",
        "|---|---|---|---|---|",
    ]
    for name, model in schema["models"].items():
        cells = [", ".join(model.get(key, [])) for key in ("size_is", "keys")]
        needed = ", ".join(f"`{figure}` ({kind})" for figure, kind in figures(name).items())
        lines.append(f"| {name} | {model['like']} | {' | '.join(cells)} | {needed} |")
    return "\n".join([*lines, ""])
