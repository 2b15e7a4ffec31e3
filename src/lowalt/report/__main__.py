"""Command line of the report: the run's tables, pictures and measurements -> one self-contained HTML page."""

import base64
import csv
import json
import sys
from pathlib import Path

import jinja2
import yaml

from lowalt.common.command import parser, pick, run
from lowalt.common.files import existing, replacing, sha256
from lowalt.common.hardware import describe
from lowalt.motion import read_table
from lowalt.report.figures import style as figures
from lowalt.report.figures.motion_strip import motion_strip
from lowalt.report.figures.tiles import example_tiles
from lowalt.report.made_with import versions
from lowalt.report.sections import recognition
from lowalt.report.sections.echo_cost import read_summary
from lowalt.report.tables import by_scheme, cloud_seconds, confusion, read_csv, spreads, stage_times
from lowalt.shards import ShardSet
from lowalt.targets.cloud import CATEGORIES, read

ACCURACY_COLUMNS = ("protocol", "scheme", "snr_db", "accuracy_percent")
STAGE_COLUMNS = ("rule", "jobs", "wall_s", "cpu_s", "peak_mib", "samples", "sample_bytes", "hardware")


COMPARISON_COLUMNS = (
    "protocol", "scheme", "over", "difference_points", "low", "high", "unit", "only_first", "only_second", "mcnemar_p",
)  # fmt: skip
EFFECT_COLUMNS = (
    "call", "effects", "motion_models", "base_ms", "added_ms", "parts_ms", "signal_change", "pixels_changed_percent",
    "pixel_difference", "cells_changed_percent", "snr_db", "accuracy_without_percent", "accuracy_with_percent",
    "difference_points", "low", "high", "scheme", "protocol", "hardware",
)  # fmt: skip


def network_words(block: dict) -> str:
    """Return the network and its training in words, from the configuration's `recognition` block."""
    network, training = block["network"], block["training"]
    start = {"none": "random initial weights", "hub": "ImageNet weights from the hub"}
    weights = start.get(network["weights"], f"weights from the file {Path(network['weights']).name}")
    seeds = len(block["seeds"])
    return (
        f"{network['backbone']} at {block['size']} pixels, {weights}, at most {training['steps']} steps of "
        f"{training['batch']} samples, {seeds} training seed{'s' if seeds > 1 else ''}"
    )


def picture(data: bytes) -> str:
    """Return PNG bytes as the address of an embedded picture."""
    return "data:image/png;base64," + base64.b64encode(data).decode()


def cloud_rows(paths: list[str], published: dict[str, dict], seconds: dict[str, float]) -> list[dict]:
    """Return one row a cloud file: subtype, category, group, source, points, the published count, time, checksum.

    seconds: time of each cloud by file name. `foot_speed` is a walker's or runner's mean speed of the standing foot.
    """
    rows = []
    for path in paths:
        cloud = read(path)
        row = published[cloud.subtype]
        rows.append(
            {
                "subtype": cloud.subtype,
                "category": cloud.category,
                "group": row["unseen_protocol"],
                "source": cloud.record["source"],
                "points": len(cloud.points),
                "published": row["points_in_published_cloud_approx"],
                "seconds": seconds.get(Path(path).stem, float("nan")),
                "foot_speed": cloud.record.get("stance_foot_speed_mps"),
                "sha256": sha256(path),
            }
        )
    return rows


def subtype_table(rows: list[dict[str, str]]) -> tuple[list[str], list[tuple[str, str, dict[str, str]]]]:
    """Return (columns, rows) of accuracy by subtype: a column a protocol and scheme, a row a subtype."""
    columns: dict[str, None] = {}
    table: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        column = f"{row['protocol']} {row['scheme']}"
        columns[column] = None
        table.setdefault((row["subtype"], row["category"]), {})[column] = f"{float(row['accuracy_percent']):.1f}"
    return list(columns), [(name, category, values) for (name, category), values in table.items()]


def write_stages(path: str | Path, times: list[dict], samples: int, size: float) -> None:
    """Write what each rule took as CSV, with the number of samples made, bytes a sample and the hardware."""
    with replacing(path) as temporary, temporary.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(STAGE_COLUMNS)
        for entry in times:
            seconds = (f"{entry['wall_s']:.2f}", f"{entry['cpu_s']:.2f}", f"{entry['peak_mib']:.0f}")
            writer.writerow([entry["rule"], entry["jobs"], *seconds, samples, f"{size:.0f}", describe()])


def main(arguments: list[str]) -> None:
    """Write the page, and the stages' times as a table."""
    options = parser("lowalt.report", __doc__)
    options.add_argument("--accuracy", required=True, help="accuracy by scheme and SNR (.csv)")
    options.add_argument("--published", help="the paper's accuracies (.csv), where there are any to stand beside")
    options.add_argument("--confusion", required=True, help="confusion counts (.csv)")
    options.add_argument("--subtypes", required=True, help="accuracy by subtype (.csv)")
    options.add_argument("--comparisons", required=True, help="paired comparisons of schemes (.csv)")
    options.add_argument("--index", required=True, help="index of the shards (.json)")
    options.add_argument("--clouds", nargs="+", required=True, help="all cloud files")
    options.add_argument("--gallery", required=True, help="picture of all clouds (.png)")
    options.add_argument("--motion", required=True, help="a motion table; its first model a category is drawn")
    options.add_argument("--benchmarks", nargs="+", required=True, help="benchmark files of all jobs (.jsonl)")
    options.add_argument(
        "--cost", nargs=3, help="what accuracy costs: table of times, of changed pixels (.csv) and figure (.png)"
    )
    options.add_argument("--effects", nargs=2, help="what each effect costs and does: table (.csv) and figure (.png)")
    recognition.add_options(options)
    options.add_argument("--stages", required=True, help="table of the stages' times to write (.csv)")
    options.add_argument("--out", required=True, help="page to write (.html)")
    given = options.parse_args(arguments)
    config, published = pick(given.settings, "config", "published")
    shards = ShardSet(given.index)
    times = stage_times(given.benchmarks)
    size = sum(shard["bytes"] for shard in shards.shards) / len(shards)
    write_stages(given.stages, times, len(shards), size)
    measured = read_csv(given.accuracy, *ACCURACY_COLUMNS, "seeds", "spread_points")
    paper = by_scheme(read_csv(given.published, *ACCURACY_COLUMNS)) if given.published else {}
    ours = by_scheme(measured)
    counts = confusion(read_csv(given.confusion, "protocol", "scheme", "category", "predicted", "samples"))
    columns, subtypes = subtype_table(read_csv(given.subtypes, "protocol", "scheme", "subtype", "accuracy_percent"))
    clouds = cloud_rows(given.clouds, published, cloud_seconds(given.benchmarks))
    pictures = {
        "accuracy": figures.accuracy_over_snr(ours, paper),
        "confusion": figures.confusion_matrices(counts, CATEGORIES),
        "times": figures.stage_bars(times),
        "clouds": existing(given.gallery, "gallery").read_bytes(),
        "strip": motion_strip([read(path) for path in given.clouds], read_table(given.motion)),
    }
    cost = None
    if given.cost:
        cost = read_summary(*given.cost[:2])
        pictures["cost"] = existing(given.cost[2], "figure of what accuracy costs").read_bytes()
    priced = []
    if given.effects:
        table, drawing = given.effects
        priced = read_csv(table, *EFFECT_COLUMNS)
        pictures["effects"] = existing(drawing, "figure of effects").read_bytes()
    more = recognition.section(given)
    pictures |= more.pop("pictures")
    labels = [f"{snr:g}" for snr in map(float, config["noise"]["snr_db"])]
    template = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    page = template.from_string(Path(__file__).with_name("page.html").read_text()).render(
        run=config["run"], seed=config["seed"], stations=list(config["network"]["stations"]), snrs=labels,
        models=len(shards) // len(labels), subtypes=len(clouds), samples=len(shards),
        sample_bytes=size, kind=shards.kind, hardware=describe(),
        ours=ours, published=paper, spreads=spreads(measured), network=network_words(config["recognition"]),
        comparisons=read_csv(given.comparisons, *COMPARISON_COLUMNS), subtype_columns=columns,
        subtype_rows=subtypes, tiles=[{"caption": text, "data": picture(data)} for text, data in example_tiles(shards)],
        clouds=clouds, more=more, times=times, cost=cost, effects=priced, versions=versions(),
        configuration=yaml.safe_dump(config, sort_keys=False),
        images={name: picture(data) for name, data in pictures.items()},
    )  # fmt: skip
    with replacing(given.out) as temporary:
        temporary.write_text(page)
    print(json.dumps({"report": given.out, "samples": len(shards)}), file=sys.stderr)


if __name__ == "__main__":
    run(main)
