"""Every cell of every table that the stage writes, and every number of them on the page, by loops
over made-up rows.

Accuracy differs by part of the protocol, fold, SNR, subtype, range and aspect, so that a table that
is made of another column, part or fold has other numbers.
"""

import json
import re
from math import floor, log
from statistics import mean, stdev
from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.config.classes import CATEGORIES
from lowalt.numerics.streams import stream
from lowalt.recognition import predictions, samples, schemes, tables
from lowalt.recognition.evaluated import Evaluated
from lowalt.report.inputs import Inputs
from lowalt.report.page import rendered
from lowalt.report.sections import accuracy, comparisons, confusion, subtypes
from made_predictions import SUBTYPES, read_rows
from pages import Page

SNRS = ("3", "8", "inf")
FOLDS = ("train", "val", "test")
STATIONS = (0, 2)
SCHEMES = {"A:VRP+TRP+VT": 3, "ABC:VRP+TRP+VT": 2}
"""Schemes of the paper's claim, each with its number of training seeds."""
GROUPED = {
    "seen": {
        "test": {("seen", "test"), ("unseen", "test")},
        "validation": {("seen", "val"), ("unseen", "val")},
    },
    "unseen": {
        "test": {("unseen", fold) for fold in FOLDS},
        "validation": {("seen", "val")},
        "seen_test": {("seen", "test")},
    },
}
PUBLISHED = {
    (protocol, name): 90 + 2.25 * place
    for place, (protocol, name) in enumerate(
        (protocol, name) for protocol in GROUPED for name in SCHEMES
    )
}
ABOUT = {
    "backbone": "net",
    "weights": "none",
    "parameters": 12345,
    "steps": 70,
    "samples_seen": 4480,
    "train_s": 12.5,
    "train_processor_s": 24.75,
    "samples_per_s": 358.4,
    "precision": "fp32",
    "ranks": 3,
}


def made_rows(seed):
    """One row a sample; its chance to be right depends on subtype, fold, SNR, distance and aspect."""
    places = stream(1, "places")
    luck = stream(seed, "luck")
    rows = []
    for at, (subtype, (group, label)) in enumerate(SUBTYPES.items()):
        for model in range(150):
            fold = FOLDS[0 if model % 5 < 2 else 1 if model % 5 < 4 else 2]
            ranges = places.uniform(50, 500, 3)
            aspects = places.uniform(0, np.pi, 3)
            for place, snr in enumerate(SNRS):
                if (model + at) % 11 == place:
                    continue  # SNRs and subtypes have different numbers of samples.
                nearest = min(STATIONS, key=lambda station: ranges[station])
                chance = 0.25 + 0.06 * at + 0.12 * place + 0.07 * FOLDS.index(fold)
                chance -= 0.1 * (ranges[nearest] > 150) + 0.1 * (aspects[nearest] > 2)
                shares = luck.dirichlet(np.ones(4))
                guess = label if luck.random() < chance else (label + 1 + (at + model) % 3) % 4
                largest = shares.argmax()
                shares[[guess, largest]] = shares[[largest, guess]]
                rows.append(
                    {
                        "key": f"{subtype}-{model:03d}-{snr}",
                        "subtype": subtype,
                        "model": model,
                        "snr": snr,
                        "group": group,
                        "fold": fold,
                        "label": label,
                        "guess": guess,
                        "p": shares.tolist(),
                        "ranges": ranges,
                        "aspects": aspects,
                        "range": ranges[nearest],
                        "aspect": np.degrees(aspects[nearest]),
                    }
                )
    return rows


def written(folder, protocol, scheme, seed, rows):
    """The prediction file of one training, and its record."""
    columns = {
        name: np.array([row[name] for row in rows])
        for name in ("key", "subtype", "model", "group", "fold", "label")
    }
    known = samples.Facts(
        **columns,
        snr_db=np.array([float(row["snr"]) for row in rows]),
        range_m=np.array([row["ranges"] for row in rows]),
        aspect_rad=np.array([row["aspects"] for row in rows]),
    )
    path = folder / f"{schemes.slug(scheme)}-{protocol}-{seed}.csv"
    predictions.write(
        path, predictions.from_facts(known, STATIONS, np.array([row["p"] for row in rows]))
    )
    about = ABOUT | {
        "protocol": protocol,
        "scheme": scheme,
        "seed": seed,
        "hardware": f"bench of {protocol}",
        "steps": 70 + seed,
    }
    path.with_suffix(".json").write_text(json.dumps(about))
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The tables of four groups of trainings, and the rows of each training by protocol and scheme."""
    folder = tmp_path_factory.mktemp("tables")
    rows = {}
    paths = []
    for number, protocol in enumerate(GROUPED):
        for place, (scheme, seeds) in enumerate(SCHEMES.items()):
            rows[protocol, scheme] = [
                made_rows(100 * number + 10 * place + seed) for seed in range(seeds)
            ]
            for seed, made in enumerate(rows[protocol, scheme]):
                paths.append(written(folder, protocol, scheme, seed, made))
    tables.write([Evaluated(path) for path in paths], list(SCHEMES), PUBLISHED, folder, 1)
    return SimpleNamespace(
        folder=folder, rows=rows, table=lambda name: read_rows(folder / f"{name}.csv")
    )


def part(run, protocol, scheme, name="test"):
    """The rows of a part of a protocol, a list a training seed."""
    return [
        [row for row in rows if (row["group"], row["fold"]) in GROUPED[protocol][name]]
        for rows in run.rows[protocol, scheme]
    ]


def right(rows):
    """Percentage of rows that name their class."""
    return 100 * sum(row["guess"] == row["label"] for row in rows) / len(rows)


def f1(rows):
    """Macro F1 in percent by its definition, class by class."""
    scores = []
    for label in sorted({row["label"] for row in rows}):
        hits = sum(row["guess"] == row["label"] == label for row in rows)
        scores.append(
            2
            * hits
            / (
                sum(row["label"] == label for row in rows)
                + sum(row["guess"] == label for row in rows)
            )
        )
    return 100 * mean(scores)


def same(found, **wanted):
    """Compare one row of a table with what is wanted: numbers to half a unit of their last digit,
    the rest as text.
    """
    assert set(found) == {"protocol", "scheme", *wanted}
    for name, value in wanted.items():
        if isinstance(value, float):
            digits = len(found[name].partition(".")[2])
            assert abs(float(found[name]) - value) <= 0.501 * 10**-digits, (
                name,
                found[name],
                value,
            )
        elif isinstance(value, tuple):
            assert value[0] <= float(found[name]) <= value[1], (name, found[name], value)
        else:
            assert found[name] == str(value), (name, found)


def by_key(rows, *names):
    """Rows of a table by protocol, scheme and further columns; none stands twice."""
    table = {tuple(row[name] for name in ("protocol", "scheme", *names)): row for row in rows}
    assert len(table) == len(rows)
    return table


def wanted_accuracy(run, name):
    """Accuracies of a part of the protocols by SNR: the bounds lie on their sides of F1, within 12
    points of it.
    """
    for protocol, scheme in run.rows:
        if name in GROUPED[protocol]:
            seeds = part(run, protocol, scheme, name)
            scores = {}
            shares = {}
            for snr in SNRS:
                of_snr = [[row for row in rows if row["snr"] == snr] for rows in seeds]
                shares[snr] = [*map(right, of_snr)]
                scores[snr] = mean(map(f1, of_snr))
            counts = {snr: sum(row["snr"] == snr for row in seeds[0]) for snr in SNRS} | {
                "avg": len(seeds[0])
            }
            shares["avg"] = [mean(values) for values in zip(*shares.values())]  # noqa: B905
            scores["avg"] = mean(scores.values())
            for snr, values in shares.items():
                score = scores[snr]
                yield (
                    (protocol, scheme, snr),
                    {
                        "snr_db": snr,
                        "accuracy_percent": mean(values),
                        "macro_f1_percent": score,
                        "macro_f1_low": (score - 25, score - 0.5),
                        "macro_f1_high": (score + 0.5, score + 25),
                        "samples": counts[snr],
                        "hardware": f"bench of {protocol}",
                        "seeds": len(values),
                        "spread_points": stdev(values),
                    },
                )


@pytest.mark.parametrize(("name", "of"), [("accuracy", "test"), ("seen_test", "seen_test")])
def test_accuracies_are_those_of_their_part_at_each_snr(run, name, of):
    wanted = dict(wanted_accuracy(run, of))
    found = by_key(run.table(name), "snr_db")
    assert list(found) == list(wanted)
    for key, row in wanted.items():
        same(found[key], **row)


def test_no_two_parts_and_no_two_snrs_have_one_accuracy(run):
    """Otherwise a table of another part would pass."""
    for protocol, scheme in run.rows:
        answers = [
            mean(
                right([row for row in rows if row["snr"] == snr])
                for rows in part(run, protocol, scheme, name)
            )
            for name in GROUPED[protocol]
            for snr in SNRS
        ]
        assert len({f"{answer:.3f}" for answer in answers}) == len(answers)


def test_each_seed_has_its_accuracy_and_what_its_training_took(run):
    found = by_key(run.table("seeds"), "seed")
    assert len(found) == 2 * sum(SCHEMES.values())
    for protocol, scheme in run.rows:
        for seed, rows in enumerate(part(run, protocol, scheme)):
            average = mean(right([row for row in rows if row["snr"] == snr]) for snr in SNRS)
            same(
                found[protocol, scheme, str(seed)],
                seed=seed,
                accuracy_percent=average,
                hardware=f"bench of {protocol}",
                **{**ABOUT, "steps": 70 + seed},
            )


@pytest.mark.parametrize("table, levels", [("confusion", []), ("confusion_by_snr", ["snr_db"])])
def test_confusion_counts_samples_over_the_seeds(run, table, levels):
    found = by_key(run.table(table), *levels, "category", "predicted")
    assert len(found) == 4 * 16 * (len(SNRS) if levels else 1)
    for (protocol, scheme, *snr, true, guess), level in found.items():
        rows = [row for rows in part(run, protocol, scheme) for row in rows]
        rows = [row for row in rows if not snr or float(row["snr"]) == float(snr[0])]
        pair = CATEGORIES.index(true), CATEGORIES.index(guess)
        same(
            level,
            category=true,
            predicted=guess,
            **dict(zip(levels, snr, strict=True)),
            samples=sum((row["label"], row["guess"]) == pair for row in rows),
        )


def test_subtypes_have_their_class_and_accuracy_the_worst_of_a_class_first(run):
    found = by_key(run.table("subtypes"), "category", "subtype")
    wanted = {}
    for protocol, scheme in run.rows:
        seeds = part(run, protocol, scheme)
        rows = []
        for subtype, (_, label) in SUBTYPES.items():
            own = [[row for row in made if row["subtype"] == subtype] for made in seeds]
            if own[0]:
                rows.append((label, mean(map(right, own)), subtype, len(own[0])))
        for label, share, subtype, count in sorted(rows):
            wanted[protocol, scheme, CATEGORIES[label], subtype] = share, count
    assert list(found) == list(wanted)
    for key, (share, count) in wanted.items():
        same(found[key], category=key[2], subtype=key[3], accuracy_percent=share, samples=count)


@pytest.mark.parametrize(
    ("name", "column", "width"), [("ranges", "range", 50), ("aspects", "aspect", 30)]
)
def test_bands_hold_the_samples_of_their_range_or_aspect(run, name, column, width):
    found = by_key(run.table(name), "from")
    wanted = {}
    for protocol, scheme in run.rows:
        bands = {}
        for seed, rows in enumerate(part(run, protocol, scheme)):
            for row in rows:
                bands.setdefault(floor(row[column] / width), {}).setdefault(seed, []).append(row)
        for band, seeds in sorted(bands.items()):
            wanted[protocol, scheme, str(band * width)] = (
                mean(map(right, seeds.values())),
                len(seeds[0]),
            )
    assert list(found) == list(wanted)
    for key, (share, count) in wanted.items():
        same(
            found[key],
            **{"from": key[2], "to": int(key[2]) + width},
            accuracy_percent=share,
            samples=count,
        )


def test_alarms_are_counted_at_thresholds_of_validation_samples(run):
    found = by_key(run.table("alarms"), "asked_percent")
    assert len(found) == 4 * 3
    for (protocol, scheme, asked), row in found.items():
        levels = []
        rates = []
        parts = part(run, protocol, scheme, "validation"), part(run, protocol, scheme)
        drones = sorted((row["p"][0] for row in parts[0][0] if row["label"] == 0), reverse=True)
        names = [
            f"{name}_{end}"
            for name in ("detected", "bird", "vehicle", "pedestrian")
            for end in ("percent", "low", "high")
        ]
        if (100 - float(asked)) / 100 * len(drones) < 10:
            same(row, asked_percent=asked, **dict.fromkeys(["threshold", *names], "not measurable"))
            continue
        for validation, test in zip(*parts, strict=True):
            drones = [row["p"][0] for row in validation if row["label"] == 0]
            needed = float(asked) / 100 * len(drones)
            levels.append(
                max(level for level in drones if sum(score >= level for score in drones) >= needed)
            )
            called = [
                [row["p"][0] >= levels[-1] for row in test if row["label"] == label]
                for label in range(4)
            ]
            rates.append([100 * mean(calls) for calls in called])
        assert float(row["threshold"]) == pytest.approx(mean(levels), rel=1e-12)
        wanted = {}
        for place, name in enumerate(("detected", "bird", "vehicle", "pedestrian")):
            rate = mean(of_seed[place] for of_seed in rates)
            wanted |= {
                f"{name}_percent": rate,
                f"{name}_low": (0, rate - 0.1),
                f"{name}_high": (rate + 0.1, 100),
            }
        same(row, asked_percent=asked, threshold=row["threshold"], **wanted)
    assert {row["threshold"] == "not measurable" for row in found.values()} == {True, False}


def test_calibration_is_that_of_test_samples(run):
    found = by_key(run.table("calibration"))
    assert len(found) == 4
    for protocol, scheme in run.rows:
        values = []
        for rows in part(run, protocol, scheme):
            gaps = [0.0] * 15
            for row in rows:
                gaps[min(int(max(row["p"]) * 15), 14)] += max(row["p"]) - (
                    row["guess"] == row["label"]
                )
            brier = mean(
                sum((p - (place == row["label"])) ** 2 for place, p in enumerate(row["p"]))
                for row in rows
            )
            entropy = mean(-log(row["p"][row["label"]]) for row in rows)
            values.append((sum(map(abs, gaps)) / len(rows), brier, entropy))
        names = "calibration_error", "brier", "cross_entropy"
        same(
            found[protocol, scheme],
            **{name: mean(column) for name, column in zip(names, zip(*values), strict=True)},  # noqa: B905
        )


def test_comparisons_and_orderings_are_differences_of_the_two_schemes_of_a_claim(run):
    (weak, _), (strong, seeds) = SCHEMES.items()
    compared = by_key(run.table("comparisons"), "over")
    ordered = by_key(run.table("orderings"), "over")
    assert list(compared) == list(ordered) == [(protocol, strong, weak) for protocol in GROUPED]
    for protocol in GROUPED:
        better, other = (mean(map(right, part(run, protocol, scheme))) for scheme in (strong, weak))
        gain = better - other
        levels = {"seen": "seeds, motion models", "unseen": "seeds, subtypes, motion models"}
        wanted = {
            "over": weak,
            "claim": "three stations over one",
            "seeds": seeds,
            "difference_points": gain,
            "low": (gain - 60, gain - 0.1),
            "high": (gain + 0.1, gain + 60),
        }
        same(compared[protocol, strong, weak], **wanted, resampled=levels[protocol])
        paper = PUBLISHED[protocol, strong] - PUBLISHED[protocol, weak]
        same(ordered[protocol, strong, weak], **wanted, paper_points=paper, ordering="not ranked")
        for name in ("difference_points", "low", "high"):
            assert ordered[protocol, strong, weak][name] == compared[protocol, strong, weak][name]


@pytest.fixture(scope="module")
def page(run):
    """The tables of the page's sections by caption, and the plots' values by section."""
    files = {
        name: str(run.folder / f"{name}.csv")
        for name in ("accuracy", "confusion_by_snr", "subtypes", "comparisons", "orderings")
    }
    (run.folder / "distances.csv").write_text(
        "category,subtype,nearest_trained,trained_distance,trained_size_ratio\n"
        + "".join(
            f"{CATEGORIES[label]},{name},near {name},0.{at}1,1.{at}2\n"
            for at, (name, (_, label)) in enumerate(SUBTYPES.items())
        )
    )
    (run.folder / "published.csv").write_text(
        "protocol,scheme,snr_db,accuracy_percent\n"
        + "".join(
            f"{protocol},{scheme},{snr},{value + place / 8}\n"
            for (protocol, scheme), value in PUBLISHED.items()
            for place, snr in enumerate((*SNRS, "avg"))
        )
    )
    files |= {
        "distances": str(run.folder / "distances.csv"),
        "seeds": "",
        "index": "",
        "clouds": [],
        "benchmarks": [],
    }
    shown = SimpleNamespace(
        inputs=Inputs(files | {"published": str(run.folder / "published.csv")}),
        snr_labels=list(SNRS),
        shards=SimpleNamespace(classes=CATEGORIES),
        config={
            "recognition": {
                "network": {"backbone": "net", "weights": "none"},
                "size": 24,
                "seeds": [0],
                "training": {"steps": 7, "batch": 64},
            }
        },
    )
    sections = {"accuracy": accuracy, "comparisons": comparisons, "subtypes": subtypes}
    text = "".join(rendered(name, section.values(shown)) for name, section in sections.items())
    return SimpleNamespace(
        tables={table["caption"]: table for table in Page(text).tables}, shown=shown
    )


@pytest.mark.parametrize("protocol", GROUPED)
def test_accuracies_stand_on_the_page_as_in_their_table(run, page, protocol):
    found = by_key(run.table("accuracy"), "snr_db")
    expected = []
    for scheme in SCHEMES:
        rows = [found[protocol, scheme, snr] for snr in (*SNRS, "avg")]
        cells = [f"{float(row['accuracy_percent']):.2f}" for row in rows]
        cells[-1] += f" ± {float(rows[-1]['spread_points']):.2f} ({SCHEMES[scheme]} seeds)"
        value, low, high = (f"{float(rows[-1][name]):.1f}" for name in tables.F1)
        expected.append([scheme, "here", *cells, f"{value} ({low} to {high})"])
        paper = [f"{PUBLISHED[protocol, scheme] + place / 8:.2f}" for place in range(4)]
        expected.append([scheme, "paper", *paper, ""])
    table = page.tables[f"Accuracy, {protocol} subtypes, percent"]
    assert table["head"] == [
        "scheme",
        "measured",
        "3 dB",
        "8 dB",
        "no noise",
        "average",
        "macro F1 (95 %)",
    ]
    assert table["rows"] == expected


def test_comparisons_and_orderings_stand_on_the_page_as_in_their_tables(run, page):
    number = "{:+.2f}".format
    assert page.tables["Paired comparisons of schemes"]["rows"] == [
        [
            row["protocol"],
            row["scheme"],
            row["over"],
            number(float(row["difference_points"])),
            f"{number(float(row['low']))} to {number(float(row['high']))}",
            row["resampled"],
            row["seeds"],
        ]
        for row in run.table("comparisons")
    ]
    assert page.tables["Orderings of the paper"]["rows"] == [
        [
            row["claim"],
            row["protocol"],
            row["scheme"],
            row["over"],
            number(float(row["paper_points"])),
            number(float(row["difference_points"])),
            row["ordering"],
        ]
        for row in run.table("orderings")
    ]


def test_subtypes_stand_on_the_page_by_protocol_and_scheme_the_worst_of_the_last_first(run, page):
    table, found = (
        page.tables["Accuracy of each subtype, percent"],
        by_key(run.table("subtypes"), "category", "subtype"),
    )
    columns = [(protocol, scheme) for protocol in GROUPED for scheme in SCHEMES]
    assert table["head"][5:] == [" ".join(column) for column in columns]
    assert sorted(row[0] for row in table["rows"]) == sorted(SUBTYPES)
    for name, category, near, distance, ratio, *cells in table["rows"]:
        at = list(SUBTYPES).index(name)
        assert [category, near, distance, ratio] == [
            CATEGORIES[SUBTYPES[name][1]],
            f"near {name}",
            f"0.{at}1",
            f"1.{at}2",
        ]
        rows = [found.get((*column, category, name)) for column in columns]
        assert cells == [f"{float(row['accuracy_percent']):.1f}" if row else "" for row in rows], (
            name
        )
    last = [float(([cell for cell in row[5:] if cell])[-1]) for row in table["rows"]]
    assert last == sorted(last)


def test_the_confusion_matrices_of_the_page_are_those_of_the_table(run, page):
    counts = {}
    for row in run.table("confusion"):
        panel = counts.setdefault(f"{row['protocol']}: {row['scheme']}", {})
        panel[row["category"], row["predicted"]] = int(row["samples"])
    wanted = []
    for panel, cells in counts.items():
        for (true, guess), count in cells.items():
            percent = 100 * count / sum(cells[true, other] for other in CATEGORIES)
            wanted.append(
                {
                    "panel": panel,
                    "true": true,
                    "recognised_as": guess,
                    "samples": count,
                    "percent": round(percent, 2),
                    "shown": f"{percent:.1f}",
                }
            )
    plot = confusion.values(page.shown)["plot"]
    assert plot.rows == wanted
    shown = re.findall(r">(\d+\.\d)<", plot.svg)
    assert shown == [row["shown"] for row in wanted]


def test_the_lines_of_accuracy_over_snr_are_the_table_s_and_the_paper_s(run, page):
    rows = accuracy.values(page.shown)["plot"].rows
    lines = {
        (row["protocol"], row["scheme"], row["snr_db"], row["source"]): row["accuracy_percent"]
        for row in rows
    }
    wanted = {}
    for place, (snr, label) in enumerate((("3", "3"), ("8", "8"), ("inf", "∞"))):
        for (protocol, scheme), paper in PUBLISHED.items():
            found = by_key(run.table("accuracy"), "snr_db")[protocol, scheme, snr][
                "accuracy_percent"
            ]
            wanted[f"{protocol} subtypes", scheme, label, "this run"] = round(float(found), 3)
            wanted[f"{protocol} subtypes", scheme, label, "paper"] = paper + place / 8
    assert lines == wanted
