"""Assembles the page, one self-contained HTML file, from its sections.

Each section is a module with its own template.
"""

from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import jinja2

from lowalt.config.extensions import function_offered, module_offered, offered
from lowalt.report.plots import Plot, plotted
from lowalt.report.reported_run import ReportedRun
from lowalt.report.sections import (
    accuracy,
    comparisons,
    confusion,
    made_with,
    other_runs,
    overview,
    recognition_cost,
    sample_viewer,
    scene_verdict,
    simulation_cost,
    subtypes,
)


class PagePart(NamedTuple):
    """A part of the page: its address in the page, its title in the contents, and its sections."""

    id: str
    title: str
    sections: tuple[ModuleType, ...]


class Section(NamedTuple):
    """A section of a run's page: its HTML, and its plots."""

    html: str
    plots: list[Plot]


PARTS = (
    PagePart("run", "This run", (overview,)),
    PagePart("samples", "Samples", (sample_viewer,)),
    PagePart("results", "Results", (subtypes, confusion, accuracy, comparisons, other_runs)),
    PagePart("cost", "What accuracy costs in time", (recognition_cost, simulation_cost)),
    PagePart("effects", "The scene", (scene_verdict,)),
    PagePart("provenance", "Provenance", (made_with,)),
)
"""The parts in the order of the page; parts without content are omitted."""


def _name(module: ModuleType) -> str:
    """A section's name, that of its module."""
    return module.__name__.rpartition(".")[2]


_MODULES = {_name(module): module for part in PARTS for module in part.sections}
SECTIONS = tuple(_MODULES)
"""The names of the sections in the order of the page.

Each module has `values(run)`. It returns the values that its template shows, or None where the run
has no such section. The template has the name of its module and lies in the same folder.
"""
TEMPLATES = Path(__file__).parent


ADDED_TO = "results"
"""The part behind whose own sections those of extensions stand."""


def templates(folder: Path = TEMPLATES) -> jinja2.Environment:
    """Return the template environment, which refuses undefined names, infinity and NaN."""
    loader = jinja2.FileSystemLoader([folder, TEMPLATES])
    environment = jinja2.Environment(
        loader=loader, autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["plotted"] = plotted
    # JSON has no infinity and no NaN.
    environment.policies["json.dumps_kwargs"] = {"sort_keys": True, "allow_nan": False}
    return environment


def rendered(name: str, values: dict | None) -> str:
    """Return the HTML of the section `name` with these values; None gives an empty text."""
    if values is None:
        return ""
    return templates().get_template(f"sections/{name}.html").render(values)


def assembled(title: str, parts: list[dict[str, str]]) -> str:
    """Return a self-contained page of parts with their contents; each has id, title and html."""
    return templates().get_template("page.html").render(title=title, parts=parts)


def section(run: ReportedRun, name: str) -> Section:
    """Return the section `name` of a run.

    Raises: InputError for a table that is missing or lacks a column.
    """
    values = _MODULES[name].values(run)
    plots = [value for value in (values or {}).values() if isinstance(value, Plot)]
    return Section(rendered(name, values), plots)


def added_sections(run: ReportedRun) -> str:
    """Return the sections of extensions for which the run's manifest has the file, as HTML.

    Raises: InputError for a file that is missing or damaged, or an extension without what it
    promises.
    """
    pieces = []
    for name, module in offered("sections").items():
        if name in run.inputs:
            values = function_offered("sections", name, module, "values")(run)
            code = Path(module_offered("sections", name, module).__file__ or "")
            file = code.with_suffix(".html")
            pieces.append(templates(file.parent).get_template(file.name).render(values))
    return "\n".join(pieces)


def page(run: ReportedRun, sections: dict[str, Section]) -> str:
    """Return the whole page of the sections by their names."""
    parts = []
    for part in PARTS:
        html = "\n".join(sections[_name(module)].html for module in part.sections)
        if part.id == ADDED_TO:
            html += "\n" + added_sections(run)
        html = html.strip()
        if html:
            parts.append({"id": part.id, "title": part.title, "html": html})
    return assembled(f"run “{run.config['run']}”", parts)
