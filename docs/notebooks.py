"""Notebooks of the tutorials, made from their Markdown, so that every text stands once.

    python docs/notebooks.py --out notebooks

A block of Python becomes a cell, a block of shell commands a cell that ends at the first failing
one, a block with a title a cell that writes this file, and all other text cells of Markdown. A
block with the title "entry" is text: the tutorial says where to insert it. The first cell goes from
the folder of the notebooks to that of the checkout, where all commands of a tutorial are to be run.
"""

import argparse
import posixpath
import re
import sys
from pathlib import Path

import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

ROOT = Path(__file__).parents[1]
TUTORIALS = ROOT / "docs/tutorials"
FENCE = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
"""A block: its language, its title, its lines."""
LINK = re.compile(r"\]\(([^)#\s:]+)((?:#[^)\s]*)?)\)")
"""A link or picture to a file, and its anchor."""
START = "%cd -q .."


def cell(language: str, title: str, text: str) -> nbformat.NotebookNode | None:
    """Return the cell that does what a block says; None for a block that is only shown."""
    if title == "entry":
        return None
    if title:
        return new_code_cell(f"%%writefile {title}\n{text}".rstrip())
    if language == "python":
        return new_code_cell(text.rstrip())
    return new_code_cell(f"%%script bash -e\n{text}".rstrip()) if language == "sh" else None


def relinked(text: str) -> str:
    """Return Markdown of a tutorial with links to files as seen from a folder at the root of the
    checkout.
    """

    def place(found: re.Match) -> str:
        """A link's target below the root, seen from a folder next to it."""
        return f"](../{posixpath.normpath(posixpath.join('docs/tutorials', found[1]))}{found[2]})"

    return LINK.sub(place, text)


def notebook(page: str) -> nbformat.NotebookNode:
    """Return the notebook of a tutorial's Markdown text; equal texts give equal notebooks."""
    cells = [new_code_cell(START)]
    shown = ""
    end = 0
    for block in FENCE.finditer(page):
        made = cell(block[1], block[2] or "", block[3])
        shown += relinked(page[end : block.start()]) + (block[0] if made is None else "")
        end = block.end()
        if made is not None:
            cells += [new_markdown_cell(shown.strip())] if shown.strip() else []
            cells = [*cells, made]
            shown = ""
    shown += relinked(page[end:])
    cells += [new_markdown_cell(shown.strip())] if shown.strip() else []
    for number, one in enumerate(cells):
        one["id"] = f"cell-{number}"
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    return new_notebook(cells=cells, metadata=kernel)


def main() -> None:
    """Write the notebook of every tutorial."""
    options = argparse.ArgumentParser(description="Write the notebooks of the tutorials.")
    options.add_argument("--out", type=Path, required=True, help="folder to write into")
    given = options.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    for path in sorted(TUTORIALS.glob("*.md")):
        made = notebook(path.read_text())
        nbformat.validate(made)
        nbformat.write(made, given.out / f"{path.stem}.ipynb")
        print(given.out / f"{path.stem}.ipynb", file=sys.stderr)


if __name__ == "__main__":
    main()
