"""Notebooks of the tutorials: every block of a page is a cell, links lead to files, and the cells
run in a kernel.
"""

import importlib
import re
import sys

import pytest

from followed_pages import FENCE, FOLDER, ROOT

PAGES = sorted(path.stem for path in FOLDER.glob("*.md"))


@pytest.fixture
def made(monkeypatch):
    """The module that makes notebooks."""
    pytest.importorskip("nbformat")
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    return importlib.import_module("notebooks")


def book(made, page):
    return made.notebook((FOLDER / f"{page}.md").read_text())


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder with links to the contents of a checkout and to the environment of this Python."""
    for name in (
        "Snakefile",
        "config",
        "design",
        "envs",
        "examples",
        "profiles",
        "src",
        "workflow",
    ):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / ".venv").symlink_to(sys.prefix)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "src"))
    monkeypatch.setenv("HF_HOME", str(tmp_path / "hub"))
    monkeypatch.setenv("HF_DATASETS_OFFLINE", "1")
    return tmp_path


def run(notebook, folder):
    """Run all cells in one kernel; returns their printed text. Fails at the first cell that raises."""
    client = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    (folder / "notebooks").mkdir()
    client.NotebookClient(
        notebook, timeout=240, resources={"metadata": {"path": str(folder / "notebooks")}}
    ).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return "".join(output.get("text", "") for output in outputs)


@pytest.mark.parametrize("page", PAGES)
def test_a_notebook_holds_every_block_and_all_text_of_its_page(made, page):
    text = (FOLDER / f"{page}.md").read_text()
    found = book(made, page)
    made.nbformat.validate(found)
    blocks = [
        (kind, title, code)
        for kind, title, code in FENCE.findall(text)
        if title or kind in ("python", "sh")
    ]
    cells = [cell.source for cell in found.cells if cell.cell_type == "code"]
    wanted = [code.rstrip() for _, title, code in blocks if title != "entry"]
    assert (
        cells[0] == made.START
        and [re.sub(r"^%%.*\n", "", source) for source in cells[1:]] == wanted
    )
    # Every sentence between blocks stands in a cell of text.
    prose = re.sub(
        r"\]\([^)]*\)|\s",
        "",
        "".join(one.source for one in found.cells if one.cell_type == "markdown"),
    )
    parts = [re.sub(r"\]\([^)]*\)|\s", "", part) for part in FENCE.sub("```", text).split("```")]
    assert len(parts) > 1 and all(part in prose for part in parts)
    assert found == book(made, page)


@pytest.mark.parametrize("page", PAGES)
def test_links_of_a_notebook_lead_to_files_of_the_repository(made, page):
    prose = "\n".join(
        cell.source for cell in book(made, page).cells if cell.cell_type == "markdown"
    )
    links = re.findall(r"\]\(([^)#\s:]+)", re.sub(r"```.*?```", "", prose, flags=re.DOTALL))
    assert not [link for link in links if not (ROOT / "notebooks" / link).resolve().exists()]


def test_cells_run_in_order_in_the_checkout_and_a_failing_line_is_not_passed_over(made, checkout):
    """`test_tutorials` runs the blocks of all pages in the quick suite."""
    errors = pytest.importorskip("nbclient").exceptions
    text = (
        "```python\nprint(open('Snakefile').read(8),"
        " end='')\n```\n```sh\nfalse\ntrue\n```\n```python\nprint(1)\n```\n"
    )
    short = made.notebook(text)
    with pytest.raises(errors.CellExecutionError):
        run(short, checkout)
    said = [output.get("text", "") for cell in short.cells for output in cell.get("outputs", [])]
    assert "".join(said) == "# lowalt"


@pytest.mark.slow
def test_the_notebook_of_a_first_data_set_runs_whole(made, checkout):
    """With the run that `test_tutorials` leaves out."""
    run(book(made, "first_data_set"), checkout)
