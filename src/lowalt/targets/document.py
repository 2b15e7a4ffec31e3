"""The page of the keys of target records: a table for each source, written from their schema.

`docs/site_pages.py` makes it as the site is built.
"""

from lowalt.files.errors import InputError
from lowalt.targets.record_schema import schema

HEAD = """\
# Keys of target records

Made from `src/lowalt/targets/records.schema.yaml`. What a record is, and how to write one:
[Records of targets](../../design/targets.md), [A target of your own](../tutorials/target.md).

"""
_PARTS = {
    "Parts of a mesh (`parts`, each by its name)": "part",
    "Meshes of a part (`meshes`, a list)": "mesh",
    "Regions (`region`, `drop`)": "region",
    "Wing beat (`flap`)": "flap",
}


def _rows(section: dict) -> list[str]:
    """One row a key: its name, whether it is needed, its meaning."""
    needed = section.get("required", [])
    lines = ["| key | meaning |", "|---|---|"]
    for name, key in section["properties"].items():
        if "description" not in key:
            raise InputError(f"schema of records: {name} has no description, expected one line of meaning")
        lines.append(f"| `{name}`{' (needed)' if name in needed else ''} | {key['description']} |")
    return lines


def page() -> str:
    """Return the page as Markdown: the keys of every record, of each source, and of what stands inside.

    Raises: InputError naming a key without a description.
    """
    whole, parts = schema(), [HEAD]
    for name, section in whole["sources"].items():
        title = "Every record" if name == "every record" else f"Source `{name}`"
        parts += [f"## {title}", "", *_rows(section), ""]
    for title, name in _PARTS.items():
        parts += [f"## {title}", "", *_rows(whole["$defs"][name]), ""]
    return "\n".join(parts)
