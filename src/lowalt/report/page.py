"""The page: the sections in their order, each a module with its own template, put into one self-contained HTML file."""

from pathlib import Path

import jinja2

from lowalt.report.run import Run
from lowalt.report.sections import (
    accuracy,
    accuracy_cost,
    alarms,
    bands,
    calibration,
    confusion,
    echo_cost,
    effects,
    made_with,
    measured,
    orderings,
    overview,
    samples,
    stages,
    subtypes,
    targets,
    trainings,
    transfer,
)

SECTIONS = (
    overview, accuracy, orderings, confusion, bands, alarms, calibration, transfer, trainings, accuracy_cost, subtypes,
    samples, targets, measured, echo_cost, effects, stages, made_with,
)  # fmt: skip
"""The sections in the order of the page.

Each module has `values(run)`. It returns the values that its template shows, or None where the run has no such section.
The template has the name of its module and lies in the same folder.
"""
TEMPLATES = Path(__file__).parent


def _templates() -> jinja2.Environment:
    loader = jinja2.FileSystemLoader(TEMPLATES)
    return jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)


def rendered(name: str, values: dict | None) -> str:
    """Return the HTML of the section `name` with these values; None gives an empty text."""
    return "" if values is None else _templates().get_template(f"sections/{name}.html").render(values)


def section_page(title: str, name: str, values: dict) -> str:
    """Return a page of the one section `name` with these values."""
    return _templates().get_template("page.html").render(title=title, sections=[rendered(name, values)])


def page(run: Run) -> str:
    """Return the whole page. Raises: InputError for a table that is missing or lacks a column."""
    texts = [rendered(module.__name__.rpartition(".")[2], module.values(run)) for module in SECTIONS]
    return _templates().get_template("page.html").render(title=run.config["run"], sections=texts)
