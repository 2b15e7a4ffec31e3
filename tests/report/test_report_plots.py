"""Plots of the page: their rows are the tables' figures, their files repeat, and their SVG stands
in a page.
"""

import csv
import re

import pytest

from lowalt.files.csv_tables import read_csv
from lowalt.report.figures import accuracy_plots, cost_plots
from lowalt.report.page import assembled
from lowalt.report.pivots import by_scheme, confusion
from lowalt.report.plots import plotted, write_plots
from pages import sound

REFERENCE = "results/reference/default"
CLASSES = ("UAV", "Bird", "Vehicle", "Pedestrian")


def table(name):
    return read_csv(f"{REFERENCE}-{name}.csv")


def answers():
    """Rows of confusion_by_snr.csv: of 10 samples of each class, one more is right per level; the
    others are birds.
    """
    levels = enumerate(("inf", "13", "3"))
    return [
        {
            "protocol": "seen",
            "scheme": "A",
            "snr_db": snr,
            "category": true,
            "predicted": guess,
            "samples": samples,
        }
        for place, snr in levels
        for true in CLASSES
        for guess, samples in ((true, 10 - place), ("Bird" if true != "Bird" else "UAV", place))
    ]


def one_of_each():
    ours = by_scheme(table("accuracy"))
    return [
        accuracy_plots.over_snr(ours, by_scheme(read_csv("config/published_accuracy.csv"))),
        accuracy_plots.confusion(confusion(table("confusion")), CLASSES),
        accuracy_plots.confusion_by_snr(answers(), CLASSES),
        cost_plots.recognition(table("accuracy_cost")),
        cost_plots.echo(table("cost")),
    ]


@pytest.fixture(scope="module")
def plots():
    return {plot.name: plot for plot in one_of_each()}


def letters(plot):
    """The texts of a plot, in their order."""
    return re.findall(r"<text[^>]*>([^<]*)</text>", plot.svg)


def test_snrs_stand_in_the_order_of_their_values_where_a_run_has_few_of_them():
    ours = {"seen": {"A:VT": {"3": 50.0, "inf": 60.0, "-5": 20.0, "avg": 55.0}}}
    paper = {"seen": {"A:VT": {"3": 90.0, "13": 95.0, "8": 93.0, "inf": 99.0}}}
    assert letters(accuracy_plots.over_snr(ours, paper))[:5] == ["-5", "3", "8", "13", "∞"]


def test_a_row_of_a_confusion_matrix_is_whole_and_a_class_without_samples_has_dashes(plots):
    shares = {}
    for row in plots["confusion"].rows:
        shares.setdefault((row["panel"], row["true"]), []).append(row["percent"])
    assert all(
        sum(found) == pytest.approx(100, abs=0.03) and len(found) == 4 for found in shares.values()
    )
    names = tuple("abcdefghi")
    crowded = accuracy_plots.confusion(
        {("seen", "A"): {(name, name): 7 for name in names[:-1]}}, names
    )
    assert [row["shown"] for row in crowded.rows][:2] == ["100.0", "0.0"]
    assert [row["shown"] for row in crowded.rows if row["true"] == "i"] == ["-"] * 9
    assert letters(crowded).count("100.0") == 8 and letters(crowded).count("-") == 9


def test_bars_of_answers_are_whole_and_stand_in_the_order_of_the_snrs(plots):
    plot = plots["confusion_by_snr"]
    shares = {
        (row["true"], row["snr_db"], row["recognised_as"]): row["percent"] for row in plot.rows
    }
    assert (
        len(shares) == 4 * 3 * 4
        and shares["UAV", "3", "Bird"] == 20
        and shares["UAV", "inf", "UAV"] == 100
    )
    assert sum(shares.values()) == pytest.approx(4 * 3 * 100)
    assert letters(plot)[:3] == ["3", "13", "∞"]
    some = accuracy_plots.confusion_by_snr(
        [row for row in answers() if row["category"] != "Bird"], CLASSES
    ).rows
    assert {row["percent"] for row in some if row["true"] == "Bird"} == {0.0}


def test_files_of_plots_repeat_and_hold_their_rows(plots, tmp_path):
    for folder, made in (("one", plots.values()), ("two", one_of_each())):
        write_plots(tmp_path / folder, made)
    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert names == sorted(f"{name}.{kind}" for name in plots for kind in ("csv", "svg"))
    assert all(
        (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
        for name in names
    )
    with (tmp_path / "one/confusion.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(plots["confusion"].rows)


def test_a_page_of_all_plots_is_sound_and_says_to_screen_readers_what_they_show(plots):
    html = "".join(map(str, map(plotted, plots.values())))
    sound(assembled("plots", [{"id": "one", "title": "One", "html": html}]))
    for plot in plots.values():
        assert f'aria-label="{plot.description}"' in html
        ids = re.findall(r' id="(.*?)"', plot.svg)
        assert all(name.startswith(f"{plot.name}-") for name in ids)
        assert set(re.findall(r'(?:href="#|url\(#)(.*?)[")]', plot.svg)) <= set(ids)


def test_a_name_is_no_part_of_the_page_that_shows_it():
    text = str(plotted(accuracy_plots.confusion({("seen", "</svg><b>"): {("a", "a"): 1}}, ("a",))))
    assert "<b>" not in text and text.count("</svg>") == 1
