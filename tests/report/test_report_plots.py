"""Plots of the page: their rows are the tables' figures, their files repeat, and Vega draws them in a browser."""

import csv
import json
import re

import pytest

from lowalt.files.csv_tables import read_csv
from lowalt.report.figures import accuracy_plots, cost_plots
from lowalt.report.page import assembled
from lowalt.report.pivots import by_scheme, confusion
from lowalt.report.plots import Plot, plotted, svg, whole, write_plots
from pages import browsed, sound

REFERENCE = "results/reference/default"


def table(name):
    return read_csv(f"{REFERENCE}-{name}.csv")


def one_of_each():
    ours = by_scheme(table("accuracy"))
    return [
        accuracy_plots.over_snr(ours, by_scheme(read_csv("config/published_accuracy.csv"))),
        accuracy_plots.confusion(confusion(table("confusion")), ("UAV", "Bird", "Vehicle", "Pedestrian")),
        cost_plots.recognition(table("accuracy_cost")), cost_plots.echo(table("cost")),
    ]  # fmt: skip


@pytest.fixture(scope="module")
def plots():
    return {plot.name: plot for plot in one_of_each()}


def test_every_accuracy_of_the_table_is_a_point(plots):
    rows = plots["accuracy_over_snr"].rows
    mine = {(row["protocol"].split()[0], row["scheme"], row["snr_db"].replace("∞", "inf")): row["accuracy_percent"]
            for row in rows if row["source"] == "this run"}  # fmt: skip
    wanted = {(row["protocol"], row["scheme"], row["snr_db"]): float(row["accuracy_percent"])
              for row in table("accuracy") if row["snr_db"] != "avg"}  # fmt: skip
    assert mine == pytest.approx(wanted, abs=1e-3)
    schemes = {row["scheme"] for row in table("accuracy")}
    assert {row["scheme"] for row in rows if row["source"] == "paper"} <= schemes


def test_snrs_stand_in_the_order_of_their_values_where_a_run_has_few_of_them():
    ours = {"seen": {"A:VT": {"3": 50.0, "inf": 60.0, "-5": 20.0, "avg": 55.0}}}
    paper = {"seen": {"A:VT": {"3": 90.0, "13": 95.0, "8": 93.0, "inf": 99.0}}}
    plot = accuracy_plots.over_snr(ours, paper)
    assert plot.spec["spec"]["encoding"]["x"]["sort"] == ["-5", "3", "8", "13", "∞"]


def test_a_row_of_a_confusion_matrix_is_whole(plots):
    shares = {}
    for row in plots["confusion"].rows:
        shares.setdefault((row["panel"], row["true"]), []).append(row["percent"])
    assert all(sum(found) == pytest.approx(100, abs=0.03) and len(found) == 4 for found in shares.values())


def test_matrices_of_many_classes_stand_in_fewer_columns_and_a_class_without_samples_has_dashes(plots):
    names = tuple("abcdefghi")
    crowded = accuracy_plots.confusion({("seen", "A"): {(name, name): 7 for name in names[:-1]}}, names)
    assert [row["shown"] for row in crowded.rows][:2] == ["100.0", "0.0"]
    assert [row["shown"] for row in crowded.rows if row["true"] == "i"] == ["-"] * 9
    assert crowded.spec["columns"] == 2 and plots["confusion"].spec["columns"] == 4
    assert re.search(r">100\.0<", svg(crowded)) and ">-<" in svg(crowded)


def test_costs_are_those_of_the_tables(plots):
    trained = [row for row in table("accuracy_cost") if row["kind"] == "trained"]
    drawn = plots["accuracy_cost"].rows
    assert {(row["scheme"], row["accuracy_percent"]) for row in drawn} == {
        (row["scheme"], float(row["unseen_percent"])) for row in trained}  # fmt: skip
    assert all(row["low"] <= row["accuracy_percent"] <= row["high"] for row in drawn)
    assert len(plots["echo_cost"].rows) == len(table("cost")) and all(
        row["error"] > 0 for row in plots["echo_cost"].rows
    )


def test_files_of_plots_repeat_and_hold_their_rows(plots, tmp_path):
    few = [(plot, svg(plot)) for plot in (plots["confusion"], plots["accuracy_over_snr"])]
    for folder in ("one", "two"):
        write_plots(tmp_path / folder, few)
    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert names == ["accuracy_over_snr.csv", "accuracy_over_snr.svg", "confusion.csv", "confusion.svg"]
    assert all((tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes() for name in names)
    with (tmp_path / "one/confusion.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(plots["confusion"].rows)
    assert "Pedestrian" in (tmp_path / "one/confusion.svg").read_text()


def test_names_inside_a_plot_are_its_own_and_do_not_tell_what_was_drawn_before(plots):
    cut = {"mark": {"type": "line", "clip": True}, "encoding": {key: {"field": key} for key in ("x", "y")}}
    clipped = plots["echo_cost"]._replace(spec=cut, rows=[{"x": 1, "y": 2}, {"x": 2, "y": 3}])
    named = [clipped, clipped._replace(name="others")]
    first, second = (re.findall(r'<clipPath id="(.*?)"', svg(plot)) for plot in named)
    assert first[0] == "echo_cost-clip1" and [name.replace("echo_cost", "others") for name in first] == second
    assert {f"url(#{name})" for name in first} == set(re.findall(r"url\(#.*?\)", svg(named[0])))
    assert svg(named[0]).replace("echo_cost-clip", "others-clip") == svg(named[1])


def test_a_name_cannot_end_the_script_that_holds_it():
    plot = accuracy_plots.confusion({("seen", "</script><b>"): {("a", "a"): 1}}, ("a",))
    text = str(plotted(plot))
    held = re.search(r'<script type="application/json">(.*?)</script>', text, re.S)[1]
    assert json.loads(held) == whole(plot) and text.count("</script>") == 1


def test_a_plot_says_to_screen_readers_what_it_shows(plots):
    for plot in plots.values():
        assert f'aria-label="{plot.description}"' in str(plotted(plot)).replace("&#39;", "'")


def test_vega_draws_every_plot_in_the_page_and_hides_the_still_picture(plots, tmp_path):
    html = "".join(map(str, map(plotted, plots.values())))
    page = assembled("plots", [{"id": "one", "title": "One", "html": html}])
    sound(page)
    script = "document.querySelectorAll('figure.plot').forEach((figure) => figure.scrollIntoView());"
    found = browsed(tmp_path, page, script)
    assert found.count('class="vega-embed') >= 2 and 'role="img" aria-label' in found
    assert len(re.findall(r'<div role="img"[^>]* hidden', found)) >= 2


def test_a_plot_without_a_value_is_refused_by_the_page_s_data():
    with pytest.raises(ValueError, match="JSON"):
        plotted(Plot("x", "x", {"mark": "bar"}, [{"a": float("nan")}]))
    assert svg(accuracy_plots.confusion({}, ("a",))).startswith("<svg")
