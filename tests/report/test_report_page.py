"""The page as a reader meets it: whole parts, links that lead somewhere, tables that sort, filter
and can be kept.
"""

import re
from types import SimpleNamespace

import pytest

from lowalt.report.inputs import FILES, KEPT, Inputs
from lowalt.report.page import PARTS, assembled, rendered
from lowalt.report.plots import Plot, plotted
from lowalt.report.sections import recognition_cost, simulation_cost
from pages import browsed, narrow, sound

ROWS = (
    ("b", "10.5"),
    ("c", ""),
    ('a, "x"', "-9 (1 to 2)"),
    *((f"d{number}", f"{20 + number}") for number in range(7)),
)


def table(rows):
    """A table of names and sizes."""
    body = "".join(f"<tr><td>{name}</td><td>{size}</td></tr>" for name, size in rows)
    head = '<tr><th scope="col">name</th><th scope="col">size</th></tr>'
    return f"<table><caption>Sizes</caption><thead>{head}</thead><tbody>{body}</tbody></table>"


@pytest.fixture(scope="module")
def kept():
    """A run without tables of its own, next to the kept reference."""
    files = dict.fromkeys(FILES, "none.csv") | {"clouds": [], "benchmarks": []}
    reference = {f"kept_{name}": f"results/reference/{file}" for name, file in KEPT.items()}
    return SimpleNamespace(inputs=Inputs(files | reference))


def test_a_run_without_own_costs_shows_the_kept_ones_and_says_so(kept):
    parts = []
    for name, section in {
        "simulation_cost": simulation_cost,
        "recognition_cost": recognition_cost,
    }.items():
        text = rendered(name, section.values(kept))
        assert "This run did not measure it" in " ".join(text.split()) and "make " in text
        parts.append({"id": name, "title": name, "html": text})
    tables = {table["caption"]: table for table in sound(assembled("kept", parts)).tables}
    assert "Recognition: accuracy and its times" in tables


def test_a_run_s_own_table_goes_before_the_kept_one(kept):
    own = Inputs(kept.inputs.files | {"accuracy_cost": kept.inputs.files["kept_accuracy_cost"]})
    assert kept.inputs.own_or_kept("accuracy_cost") == "kept_accuracy_cost"
    assert (
        own.own_or_kept("accuracy_cost") == "accuracy_cost" and own.own_or_kept("transfer") is None
    )
    text = " ".join(
        rendered("recognition_cost", recognition_cost.values(SimpleNamespace(inputs=own))).split()
    )
    assert "This run measured it on " in text and "did not" not in text


def test_the_contents_name_every_part_of_the_page():
    parts = [{"id": part.id, "title": part.title, "html": "<p>x</p>"} for part in PARTS]
    page = sound(assembled("run", parts))
    assert page.links[1:] == [f"#{part.id}" for part in PARTS]


def test_tables_sort_by_value_filter_and_download_and_the_theme_turns(tmp_path):
    script = """
    const column = (at) => [...document.querySelectorAll("tbody tr")].map((row) => row.cells[at].textContent)
      .filter((text) => !text.startsWith("d")).join("|");
    const said = [], heads = document.querySelectorAll("th button");
    heads[1].click(); said.push(column(0)); heads[1].click(); said.push(column(0));
    heads[0].click(); said.push(column(0));
    const field = document.querySelector("input");
    field.value = "10.5"; field.dispatchEvent(new Event("input"));
    said.push(document.querySelector("output").textContent);
    field.value = "a,"; field.dispatchEvent(new Event("input"));
    document.getElementById("theme").click(); said.push(document.documentElement.dataset.theme);
    // A blob is read later, perhaps after the page was taken down; its parts are known at once.
    window.Blob = class extends Blob {
      constructor(parts, options) { super(parts, options); document.body.dataset.csv = parts.join(""); }
    };
    // A real download keeps a headless browser from ending.
    HTMLAnchorElement.prototype.click = function () { document.body.dataset.file = this.download; };
    document.querySelector(".tools button").click();
    document.body.dataset.said = said.join(";");
    """
    found = browsed(
        tmp_path, assembled("t", [{"id": "one", "title": "One", "html": table(ROWS)}]), script
    )
    assert (
        re.search('data-said="(.*?)"', found)[1]
        == "a, &quot;x&quot;|b|c;b|a, &quot;x&quot;|c;a, &quot;x&quot;|b|c;1 of 10 rows;light"
    )
    csv = re.search('data-csv="(.*?)"', found, re.S)[1].replace("&quot;", '"')
    assert csv == 'name,size\n"a, ""x""",-9 (1 to 2)\n'
    assert 'data-file="sizes.csv"' in found
    assert 'aria-sort="ascending"' in found and 'aria-current="true"' in found


def test_a_table_below_ten_rows_sorts_and_scrolls_but_has_neither_filter_nor_download(tmp_path):
    script = """
    document.querySelectorAll("th button")[1].click();
    const first = document.querySelector("tbody td").textContent;
    const many = (name) => document.querySelectorAll(name).length;
    document.body.dataset.said = [first, many(".scroll > table"), many(".tools")].join(";");
    """
    found = browsed(
        tmp_path, assembled("t", [{"id": "one", "title": "One", "html": table(ROWS[:9])}]), script
    )
    assert re.search('data-said="(.*?)"', found)[1] == "a, &quot;x&quot;;1;0"


def test_a_telephone_shows_whole_tiles_plots_and_navigation(tmp_path):
    tile = (
        '<figure><div class="tile"><div class="down"><span>A</span></div><img alt="a"'
        ' src="data:,"></div></figure>'
    )
    picture = '<svg width="{0}" height="9" viewBox="0 0 {0} 9"></svg>'
    plot = Plot("p", "plot", picture.format(900), [], picture.format(353))
    html = f'<div class="row tiles">{4 * tile}</div>{plotted(plot)}'
    parts = [{"id": part.id, "title": part.title, "html": html} for part in PARTS]
    script = """
    const page = frame.contentDocument, box = (node) => node.getBoundingClientRect();
    const rights = [...page.querySelectorAll("nav a")].map((link) => box(link).right);
    const widths = [...page.querySelectorAll(".plot svg")].map((svg) => box(svg).width).filter(Boolean);
    document.body.dataset.said = [page.documentElement.scrollWidth <= 390, box(page.querySelector(".tile img")).width >= 160,
      Math.max(...rights) <= 390, new Set(widths).size, widths[0]].join(";");
    """
    found = narrow(tmp_path, assembled("t", parts), script)
    assert re.search('data-said="(.*?)"', found)[1] == "true;true;true;1;353"
