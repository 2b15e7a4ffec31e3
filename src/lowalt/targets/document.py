"""The page of keys: design/targets.md, whose tables are written from the schema of records.

    python -m lowalt.targets.document design/targets.md

rewrites what stands between the two marks of the page and leaves the rest.
"""

import argparse
from pathlib import Path

from lowalt.config.command import run
from lowalt.files.atomic import existing, replacing
from lowalt.files.errors import InputError
from lowalt.targets.record_schema import schema

BEGIN, END = "<!-- keys of records -->", "<!-- end of the keys -->"
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


def tables() -> str:
    """Return the tables of all keys as Markdown: those of every record, of each source, and of what stands inside.

    Raises: InputError naming a key without a description.
    """
    whole, parts = schema(), []
    for name, section in whole["sources"].items():
        title = "Every record" if name == "every record" else f"Source `{name}`"
        parts += [f"### {title}", "", *_rows(section), ""]
    for title, name in _PARTS.items():
        parts += [f"### {title}", "", *_rows(whole["$defs"][name]), ""]
    return "\n".join(parts)


def rewritten(text: str) -> str:
    """Return a page with the tables between its marks.

    Raises: InputError where the page does not have each mark once.
    """
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise InputError(f"page of targets: expected the marks {BEGIN} and {END} once each")
    before, _, rest = text.partition(BEGIN)
    return f"{before}{BEGIN}\n\n{tables()}\n{END}{rest.partition(END)[2]}"


def main(arguments: list[str]) -> None:
    """Rewrite the tables of keys in a page."""
    line = argparse.ArgumentParser(prog="python -m lowalt.targets.document", description=main.__doc__)
    line.add_argument("page", type=Path, help="Markdown file with the two marks")
    given = line.parse_args(arguments)
    text = rewritten(existing(given.page, "page").read_text())
    with replacing(given.page) as temporary:
        temporary.write_text(text)


if __name__ == "__main__":
    run(main)
