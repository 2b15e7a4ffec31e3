"""Pages of the documents, followed block by block as they are printed."""

import contextlib
import importlib
import io
import re
import runpy
import shlex
import sys
from pathlib import Path

from lowalt.__main__ import main

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs/tutorials"
FENCE = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
SCHEMA = "workflow/schemas/config.schema.yaml"


def linked_checkout(folder: Path, monkeypatch) -> Path:
    """Link what a checkout holds into a folder, and make it the current one for a test."""
    for name in ("config", "design", "examples", "workflow"):
        (folder / name).symlink_to(ROOT / name)
    monkeypatch.chdir(folder)
    monkeypatch.setenv("HF_HOME", str(folder / "hub"))
    monkeypatch.setenv("HF_DATASETS_OFFLINE", "1")
    return folder


def in_this_process(line, monkeypatch):
    """Run a command here, where the libraries are loaded already; returns what it prints."""
    words = shlex.split(line)
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        if words[0] == ".venv/bin/lowalt":
            assert main(words[1:]) == 0
        elif words[1] == "-m":
            importlib.import_module(f"{words[2]}.__main__").main(words[3:])
        else:
            monkeypatch.setattr(sys, "argv", words[1:])
            runpy.run_path(words[1], run_name="__main__")
    return printed.getvalue()


def followed(page, folder, monkeypatch, more=None):
    """Do what a page says: write the files it names, run its commands and its Python; returns
    (printed, names).

    more: options by the line that gets them besides its own.
    """
    printed = ""
    names = {"__name__": page}
    for language, title, block in FENCE.findall((FOLDER / f"{page}.md").read_text()):
        if title:
            (folder / title).write_text(block)
        elif language == "sh":
            for line in block.splitlines():
                if line.startswith(".venv/bin/lowalt run "):
                    continue  # a whole run: tests/test_notebooks.py has the slow ones
                printed += in_this_process(f"{line} {(more or {}).get(line, '')}", monkeypatch)
        elif language == "python":
            exec(compile(block, f"{page}.md", "exec"), names)
    return printed, names
