"""Probability of detection against false alarms, by class, scene and SNR or range: detection.csv and detection.png.

Each look of one second becomes a range-Doppler map; a look counts as detected where a detection is the target's
(`lowalt.tiles.detections`). False alarms are counted in the same looks without a target: empty air, or land alone.
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import binomtest

from lowalt.config.layers import check, load, merge
from lowalt.files.csv_tables import write_csv
from lowalt.shards.dataset import Dataset, Place
from lowalt.tiles.cubes import Cubes
from lowalt.tiles.detections import detections

BASE, SCHEMA = Path("config/default.yaml"), "workflow/schemas/config.schema.yaml"
SUBTYPES = {"UAV": "DJI Mavic 3 Pro", "Bird": "Crow", "Vehicle": "AITO M9 2024", "Pedestrian": "Walking Pedestrian 1"}
RATES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
SNRS = (-20.0, -15.0, -10.0, -5.0, 0.0)
"""dB, of a symbol in the target's cell; a map of 400 symbols gains 26 dB less the window's 1.8."""
RANGES = ((0, 200), (200, 300), (300, 400), (400, 600))
SCENES = {
    "empty air": ({}, SNRS),
    "town": ("config/scenes/urban.yaml", SNRS),
    "absolute powers": ({"mean_cross_section": {}, "receiver_noise": {}}, (np.inf,)),
}
COLUMNS = (
    "scene", "class", "snr_db", "range_m", "false_alarm", "looks", "detected_percent", "low", "high",
    "false_alarms_per_look",
)  # fmt: skip


def of_scene(name: str) -> Dataset:
    """Return the data set of a scene's subtypes."""
    scene, _ = SCENES[name]
    paths = [BASE, Path(scene)] if isinstance(scene, str) else [BASE]
    config = load(paths, SCHEMA)
    config = merge(config, {"targets": {"select": [*SUBTYPES.values()]}})
    return Dataset(check(merge(config, {} if isinstance(scene, str) else {"effects": scene}), SCHEMA))


def looks(name: str, models: int) -> list[tuple]:
    """Return (class, SNR, range of the look, false-alarm rate, whether detected, false alarms) of all looks."""
    dataset, snrs, found = of_scene(name), SCENES[name][1], []
    network, maker = dataset.maker.network, dataset.maker
    settings = {"seed": maker.seed, "network": maker.render["network"], **maker.echo}
    full, empty = (
        Cubes.from_settings(settings, dataset.clouds, maker.occluders, empty=nothing) for nothing in (False, True)
    )
    groups = {subtype: group for group, members in dataset.plan.groups.items() for subtype in members}
    for category, subtype in SUBTYPES.items():
        for model in range(models):
            row = dataset.row(Place(groups[subtype], subtype, model, 0.0))
            station = network.stations[model % len(network.stations)]
            for snr_db in snrs:
                seen, bare = (cubes.of(row, snr_db, station) for cubes in (full, empty))
                for rate in RATES:
                    hit = detections(seen, network, station, rate)["true"].any()
                    alarms = len(detections(bare, network, station, rate))
                    found.append((category, snr_db, seen.truth[0, 0], rate, bool(hit), alarms))
    return found


def table(name: str, found: list[tuple]) -> list[list]:
    """Return the rows of one scene, by class and SNR, or by class and range where noise is absolute."""
    rows = []
    by_range = SCENES[name][1] == (np.inf,)
    bins = [(np.inf, reach) for reach in RANGES] if by_range else [(snr, (0, np.inf)) for snr in SNRS]
    for category in SUBTYPES:
        for snr_db, (near, far) in bins:
            for rate in RATES:
                alike = [each for each in found if each[:2] == (category, snr_db) and each[3] == rate]
                mine = [each for each in alike if near <= each[2] < far]
                if mine:
                    hits = sum(each[4] for each in mine)
                    low, high = binomtest(hits, len(mine)).proportion_ci(method="wilson")
                    shown = f"{near} to {far}" if by_range else "all"
                    alarms = np.mean([each[5] for each in mine])
                    rows.append([name, category, "" if by_range else f"{snr_db:g}", shown, f"{rate:g}", len(mine),
                                 f"{100 * hits / len(mine):.1f}", f"{100 * low:.1f}", f"{100 * high:.1f}",
                                 f"{alarms:.3g}"])  # fmt: skip
    return rows


def picture(rows: list[list], path: Path) -> None:
    """Draw detection over false alarms per look, one panel per class of empty air and town, one line per SNR."""
    names = list(SCENES)[:2]
    figure, panels = plt.subplots(2, 4, figsize=(12, 5.5), sharex=True, sharey=True, layout="constrained")
    for line, name in zip(panels, names, strict=True):
        for panel, category in zip(line, SUBTYPES, strict=True):
            for snr in SNRS:
                mine = [row for row in rows if row[0] == name and row[1] == category and row[2] == f"{snr:g}"]
                panel.plot([float(row[9]) for row in mine], [float(row[6]) for row in mine], "o-", label=f"{snr:g} dB")
            panel.set_xscale("symlog", linthresh=0.1)
            panel.set(title=f"{category}, {name}", ylim=(-3, 103))
    figure.supxlabel("false alarms in a look of one second without a target")
    figure.supylabel("looks in which the target is detected (%)")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), title="SNR of a symbol", loc="outside right")
    figure.savefig(path, dpi=90)


def main() -> None:
    """Compute the table and the picture."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--models", type=int, default=20, help="looks per class")
    options.add_argument("--out", type=Path, required=True)
    given, rows = options.parse_args(), []
    for name in SCENES:
        rows += table(name, looks(name, given.models))
        print(name, flush=True)
    write_csv(given.out / "detection.csv", COLUMNS, rows)
    picture(rows, given.out / "detection.png")


if __name__ == "__main__":
    main()
