"""The schema of a target's record: which keys each source knows, their types and meaning; the files that a record has.

The page of the keys is written from it as `docs/site_pages.py` makes the site.
"""

import functools
from pathlib import Path, PureWindowsPath

from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml

PATH = Path(__file__).with_name("records.schema.yaml")
COMMON = "every record"
"""Section of the keys that records of all sources have."""
FORBIDDEN = "{}\\"
"""Characters that a file's name must not have: Snakemake takes braces for a wildcard, and a backslash is a folder on
Windows only."""

HEAD = """\
# Keys of target records

Made from `src/lowalt/targets/records.schema.yaml`. What a record is, and how to write one:
[Records of targets](../../design/targets.md), [A target of your own](../tutorials/target.md).

"""
_INSIDE = {
    "Parts of a mesh (`parts`, each by its name)": "part", "Meshes of a part (`meshes`, a list)": "mesh",
    "Regions (`region`, `drop`)": "region", "Wing beat (`flap`)": "flap",
}  # fmt: skip


@functools.cache
def schema() -> dict:
    """Return the whole schema: `$defs`, under `sources` a JSON schema for each source and for COMMON, and the built-in
    `models` with sets of their `figures`."""
    return load_yaml(PATH)


def keys(section: str) -> tuple[str, ...]:
    """Return the names of the keys of a source, or of COMMON."""
    return tuple(schema()["sources"][section]["properties"])


def check(section: str, record: dict, where: str) -> None:
    """Refuse keys of a record that are unknown to a section, missing, or of another value than it says.

    Raises: InputError naming `where`, the key, its value and what was expected.
    """
    from lowalt.config.schema import faults  # slow to import, and a cloud is made without it

    if found := faults(record, {"$defs": schema()["$defs"], **schema()["sources"][section]}, "record"):
        raise InputError(f"{where}: {found[0]}")


def figures(model: str) -> dict[str, str]:
    """Return the figures that a built-in model needs by name, each a length, ratio, offset, count or whole number."""
    sets = [schema()["figures"][item] if isinstance(item, str) else item
            for item in schema()["models"][model]["figures"]]  # fmt: skip
    return {name: kind for each in sets for name, kind in each.items()}


def record_files(record: dict) -> list[str]:
    """Return the user's files that a merged record names, relative to the folder of inputs, each once, in order."""
    files = [mesh["file"] for part in record.get("parts", {}).values() for mesh in part.get("meshes", [])]
    return list(dict.fromkeys([*files, *(record[key] for key in ("skeleton", "motion") if key in record)]))


def check_file_name(name: str, where: str) -> None:
    """Refuse a file name that leaves the folder of inputs or that the workflow cannot pass on.

    Raises: InputError naming `where`, the name and what was expected.
    """
    path = PureWindowsPath(name)
    if not name.strip() or path.drive or path.root or ".." in path.parts:
        raise InputError(f"{where}: file is {name!r}, expected a path inside the folder of inputs")
    if wrong := sorted({letter for letter in name if letter in FORBIDDEN or not letter.isprintable()}):
        raise InputError(f"{where}: file is {name!r}, expected a name without {wrong}: rename the file")


def page(content: dict) -> str:
    """Return the page of a schema's keys as Markdown: those of every record, of each source, and of what stands inside.

    Raises: InputError naming a key without a description.
    """
    sections = {"Every record" if name == COMMON else f"Source `{name}`": section
                for name, section in content["sources"].items()}  # fmt: skip
    sections |= {title: content["$defs"][name] for title, name in _INSIDE.items()}
    lines = [HEAD]
    for title, section in sections.items():
        lines += [f"## {title}", "", "| key | meaning |", "|---|---|"]
        for name, key in section["properties"].items():
            if "description" not in key:
                raise InputError(f"schema of records: {name} has no description, expected one line of meaning")
            lines.append(f"| `{name}`{' (needed)' * (name in section.get('required', []))} | {key['description']} |")
        lines.append("")
    lines += [
        "## Built-in models (`model`)",
        "",
        "| model | like | size_is | keys | figures |",
        "|---|---|---|---|---|",
    ]
    for name, model in content["models"].items():
        cells = [", ".join(model.get(key, [])) for key in ("size_is", "keys")]
        needed = ", ".join(f"`{figure}` ({kind})" for figure, kind in figures(name).items())
        lines.append(f"| {name} | {model['like']} | {' | '.join(cells)} | {needed} |")
    return "\n".join([*lines, ""])
