"""The page: the sections in their order, each a module with its own template, put into one self-contained HTML file."""

from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import jinja2

from lowalt.report.plots import Plot, plotted, scripts
from lowalt.report.run import ReportedRun
from lowalt.report.sections import (
    accuracy,
    accuracy_cost,
    alarms,
    bands,
    calibration,
    confusion,
    echo_cost,
    effects,
    hard_cases,
    made_with,
    measured,
    orderings,
    overview,
    samples,
    scene,
    stages,
    subtypes,
    targets,
    trainings,
    transfer,
)


class PagePart(NamedTuple):
    """A part of the page: its address in the page, its title in the contents, and its sections."""

    id: str
    title: str
    sections: tuple[ModuleType, ...]


RESULTS = (accuracy, orderings, confusion, subtypes, bands, alarms, calibration, transfer, trainings)
PARTS = (
    PagePart("run", "This run", (overview,)),
    PagePart("results", "Results", RESULTS),
    PagePart("cost", "What accuracy costs in time", (echo_cost, accuracy_cost)),
    PagePart("hard-cases", "Hard cases", (hard_cases,)),
    PagePart("effects", "Effects and scenes", (effects, scene)),
    PagePart("measured", "Held against measurement", (measured,)),
    PagePart("targets", "Targets", (targets,)),
    PagePart("samples", "Samples", (samples,)),
    PagePart("stages", "Stage times", (stages,)),
    PagePart("provenance", "Provenance", (made_with,)),
)
"""The parts in the order of the page. Every page has all of them; a part without values says so."""
SECTIONS = tuple(section for part in PARTS for section in part.sections)
"""The sections in the order of the page.

Each module has `values(run)`. It returns the values that its template shows, or None where the run has no such section.
The template has the name of its module and lies in the same folder.
"""
TEMPLATES = Path(__file__).parent


def _templates() -> jinja2.Environment:
    """The templates, which refuse a name that nobody gave them."""
    loader = jinja2.FileSystemLoader(TEMPLATES)
    environment = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    environment.filters["plotted"] = plotted
    return environment


def rendered(name: str, values: dict | None) -> str:
    """Return the HTML of the section `name` with these values; None gives an empty text."""
    return "" if values is None else _templates().get_template(f"sections/{name}.html").render(values)


def assembled(title: str, parts: list[dict[str, str]]) -> str:
    """Return a self-contained page of parts with their contents; each has id, title and html."""
    drawn = any('<figure class="plot">' in part["html"] for part in parts)
    return _templates().get_template("page.html").render(title=title, parts=parts, plots=scripts() if drawn else "")


def section_page(title: str, name: str, values: dict) -> str:
    """Return a page of the one section `name` with these values."""
    return assembled(title, [{"id": name, "title": title, "html": rendered(name, values)}])


def contents(run: ReportedRun) -> dict[str, dict | None]:
    """Return the values of every section by its name.

    Raises: InputError for a table that is missing or lacks a column.
    """
    return {_name(module): module.values(run) for module in SECTIONS}


def _name(module: ModuleType) -> str:
    """A section's name, that of its module."""
    return module.__name__.rpartition(".")[2]


def plots(values: dict[str, dict | None]) -> list[Plot]:
    """Return the plots among the sections' values, in the order of the page."""
    return [held for section in values.values() for held in (section or {}).values() if isinstance(held, Plot)]


def page(run: ReportedRun, values: dict[str, dict | None]) -> str:
    """Return the whole page of the sections' values."""
    parts = []
    for part in PARTS:
        texts = [rendered(_name(module), values[_name(module)]) for module in part.sections]
        html = "\n".join(texts).strip() or "<p>Neither this run nor the kept reference has measured this.</p>"
        parts.append({"id": part.id, "title": part.title, "html": html})
    return assembled(f"run “{run.config['run']}”", parts)
