"""Section: what the run is, its accuracies beside the paper's, and a tile of each category."""

from lowalt.files.csv_tables import read_csv
from lowalt.machine.hardware import describe
from lowalt.report.figures.style import embedded
from lowalt.report.figures.tile_axes import example_tiles
from lowalt.report.pivots import best_schemes, by_scheme, macro_f1
from lowalt.report.reported_run import ReportedRun
from lowalt.report.sections.accuracy import COLUMNS
from lowalt.spectra.catalogue import named

TILES = 4
"""Most tiles at the top of the page."""


def verdict(entries: list[dict], classes: int) -> str:
    """Return sentences that help to judge the entries of `accuracies`, said once for all."""
    words = [f"Chance level is {100 / classes:.0f} %."]
    if any(entry["paper"] is not None for entry in entries):
        words.append("The paper's data are not public, so its figures are not comparable.")
    if any(entry["seeds"] < 3 for entry in entries):
        words.append("One training seed; another seed changes an accuracy by about one point.")
    return " ".join(words)


def accuracies(rows: list[dict[str, str]], published: list[dict[str, str]]) -> list[dict]:
    """Return one entry per protocol, on its scheme of highest average.

    An entry has the accuracy beside the paper's, the interval of macro F1, and the number of
    training seeds.
    """
    ours = by_scheme(rows)
    paper = by_scheme(published)
    intervals = macro_f1(rows)
    entries = []
    for protocol, scheme in best_schemes(ours).items():
        here = ours[protocol][scheme]["avg"]
        there = paper.get(protocol, {}).get(scheme, {}).get("avg")
        entries.append(
            {
                "protocol": protocol,
                "scheme": scheme,
                "percent": here,
                "paper": there,
                "interval": intervals.get(protocol, {}).get(scheme, ""),
                "seeds": max(int(row["seeds"]) for row in rows),
            }
        )
    return entries


def values(run: ReportedRun) -> dict:
    """Return the run's size, its accuracies with a verdict, and tiles of its first classes."""
    published = []
    if "published" in run.inputs:
        published = read_csv(run.inputs.path("published"), *COLUMNS)
    measured = run.inputs.table("accuracy", *COLUMNS, "seeds", "spread_points")
    best = accuracies(measured, published)
    tiles = [(caption, embedded(data)) for caption, data in example_tiles(run.shards)[:TILES]]
    return {
        "seed": run.config["seed"],
        "stations": len(run.stations),
        "snrs": len(run.snr_labels),
        "models": len(run.shards) // len(run.snr_labels),
        "subtypes": len(run.inputs.paths("clouds")),
        "samples": len(run.shards),
        "kind": run.shards.kind,
        "sample_bytes": run.sample_bytes,
        "hardware": describe(),
        "station_names": run.stations,
        "spectra": [name.upper() for name in named(run.config["spectra"])],
        "accuracies": best,
        "verdict": verdict(best, len(run.shards.classes)) if best else "",
        "tiles": tiles,
    }
