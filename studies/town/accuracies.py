"""What buildings do to recognition: a network in the paper's scene, in `urban` and among the blocks of a town.

    python studies/town/accuracies.py --out studies/town/results --figure docs/pictures/town-accuracy.png

Needs the data sets `results/town-{paper,urban,blocks}` that the study's Makefile makes: the same motion models in three
scenes. Trains a network in the paper's scene and one in the town, on targets that stand in no building, and tries both
in all three scenes.
accuracy.csv: by part of the held-out targets, scene and training, the share of right answers, and its difference to the
network that was trained and tried in the paper's scene; 95 % intervals resample training seeds and subtypes.
cells.csv: the share of symbols whose range cell is within one of the target's; intervals resample motion models.
seen.csv: to which of the stations a direct ray leads, reflected ones alone, or none; intervals as in cells.csv.
"""

import argparse
from collections.abc import Callable
from functools import cache, partial
from itertools import product
from pathlib import Path

import numpy as np

import trainings
from lowalt.config.command import run
from lowalt.extensions.town.buildings import read
from lowalt.extensions.town.town import DEFAULTS
from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import read_csv, write_csv
from lowalt.numerics.streams import stream
from lowalt.recognition import runs
from lowalt.recognition.evaluated import Evaluated
from lowalt.recognition.intervals import bootstrap, model_shares, strict_difference
from lowalt.recognition.protocols import folds
from lowalt.recognition.samples import ViewSamples
from lowalt.recognition.schemes import TABLE, Scheme, named
from lowalt.scene.chain import SceneSample
from lowalt.scene.explanation import CLOSE_CELLS, samples, scene_of
from lowalt.scene.observe import observe
from lowalt.shards import ShardSet

HERE = Path(__file__).parent
SCENES = {"paper": "config/scenes/paper.yaml", "urban": "config/scenes/urban.yaml", "blocks": HERE / "blocks.yaml"}
TRAINED_ON, PROTOCOL = ("paper", "blocks"), "unseen"
HEIGHTS_M = {
    "up to 30 m over the roofs": (-np.inf, 30.0), "30 to 60 m over the roofs": (30.0, 60.0),
    "60 m over the roofs and more": (60.0, np.inf),
}  # fmt: skip
"""Heights over the highest roof by which flying targets are sorted."""
SIGHTS = ("direct", "reflected alone", "none")
CELLS_MODELS = 2
"""Motion models of each held-out subtype whose range cells are counted."""
Inside = Callable[[dict], bool]


def config_of(scene: str) -> dict:
    """Return the trial's configuration in a scene."""
    return trainings.config_of(HERE / "trial.yaml", SCENES[scene])


def data_of(scene: str) -> Path:
    """Return the folder of the run that made a scene's data set."""
    return trainings.ROOT / f"results/town-{scene}"


@cache
def records() -> dict[str, dict]:
    """Return a record of each motion model in the town, by subtype/model."""
    shards = ShardSet(data_of("blocks") / "shards/index.json", check=False)
    quiet = np.flatnonzero(np.isinf(shards.snrs_db))
    return {f"{entry['subtype']}/{entry['model']}": entry for entry in map(shards.record, quiet.tolist())}


def sight(record: dict, station: str) -> str:
    """Return by which rays a station sees a target: one of SIGHTS."""
    found = record["paths"]["stations"][station]
    return "direct" if found["direct"] else "reflected alone" if found["reflected"] else "none"


def outside(record: dict) -> bool:
    """Return whether a target stands in no building."""
    return not record["paths"]["under_roof"]


def parts() -> dict[str, Inside]:
    """Return the parts into which targets are sorted: whether a record belongs to it."""
    roof_m = read(DEFAULTS | config_of("blocks")["effects"]["town"]).facts["high_m"][2]

    def height(record: dict, low: float, high: float) -> bool:
        flies = outside(record) and record["category"] in ("UAV", "Bird")
        return flies and low <= record["motion"]["z_m"] - roof_m < high

    def stations(record: dict, count: int) -> bool:
        seen = [place["direct"] for place in record["paths"]["stations"].values()]
        return outside(record) and sum(seen) == count

    ground = {"on the ground": lambda record: outside(record) and record["category"] in ("Vehicle", "Pedestrian")}
    flying = {name: partial(height, low=low, high=high) for name, (low, high) in HEIGHTS_M.items()}
    seen = {f"direct ray to {count} stations": partial(stations, count=count) for count in range(4)}
    inside = {"in a building": lambda record: not outside(record)}
    return {"outside": outside, **ground, **flying, **seen, **inside}


def source(scene: str, scheme: Scheme, pairs: set, part: str, size: int) -> ViewSamples:
    """Return the samples of (group, fold) pairs in a scene; those that train or validate stand in no building."""
    found = trainings.images_of(data_of(scene), scheme, pairs, size)
    if part in trainings.PARTS:
        known = {name for name, record in records().items() if outside(record)}
        found.keep(np.flatnonzero([name in known for name in found.facts.motion.tolist()]))
    return found


def evaluated(out: Path) -> dict[tuple[str, str], list[Evaluated]]:
    """Return, by scene and the scene trained on, the networks' answers to held-out subtypes, one per training seed.

    What is trained and evaluated already is taken from `out`.
    """
    config = config_of("blocks")
    size, stations = config["recognition"]["size"], list(config["network"]["stations"])
    scheme = named(TABLE, config["recognition"]["schemes"][0], stations)
    found: dict[tuple[str, str], list[Evaluated]] = {}
    for trained_on, seed in product(TRAINED_ON, config["recognition"]["seeds"]):
        job, folder = trainings.Job(scheme, PROTOCOL, seed), out / trained_on
        trainings.trained(job, config, data_of(trained_on), folder, partial(source, trained_on, size=size))
        model = runs.load(folder / f"models/{job.name}/model.safetensors")
        for scene in SCENES:
            path = folder / f"{scene}/{job.name}.csv"
            if not path.with_suffix(".json").is_file():
                asked = source(scene, scheme, folds(PROTOCOL, "test"), "asked", size)
                runs.evaluate(model, asked, config["recognition"]["evaluation"], path, trained_on)
            found.setdefault((scene, trained_on), []).append(Evaluated(path))
    return found


def accuracies(found: dict[tuple[str, str], list[Evaluated]], seed: int) -> list[list]:
    """Return the rows of accuracy.csv."""
    rows, (reference, *_) = [], found.values()
    for part, belongs in parts().items():
        inside = {name for name, record in records().items() if belongs(record)}
        if not inside & set(reference[0].test.motion.tolist()):
            continue
        for (scene, trained_on), networks in found.items():
            shares = []
            for each in (networks, reference):
                test = each[0].test
                chosen = np.flatnonzero([name in inside for name in test.motion.tolist()])
                shares.append(model_shares(test.motion[chosen], [one.test.correct[chosen] for one in each]))
            (first, count, ours), (*_, theirs) = shares
            subtype = networks[0].test.subtype[chosen][first]
            draws = partial(stream, seed, "town", part, scene, trained_on)
            alone = strict_difference(ours, np.zeros_like(ours), count, subtype, True, draws("accuracy"))
            alone = np.clip(alone, 0.0, 1.0)
            over = strict_difference(ours, theirs, count, subtype, True, draws("difference"))
            rows.append([part, scene, trained_on, len(count), *(f"{100 * one:.2f}" for one in (*alone, *over))])
    return rows


def right_cells(scene: str) -> dict[tuple[str, str], float]:
    """Return the share of symbols whose range cell is the target's or next to it, by motion model and station."""
    config, result = config_of(scene), {}
    names = sorted({record["subtype"] for record in records().values() if record["group"] == "unseen"})
    chosen, physics = samples(config, None, list(product(names, range(CELLS_MODELS)))), scene_of(config)
    clouds = {one.cloud.subtype: one.cloud for one in chosen}
    for one, station in product(chosen, physics.network.stations):
        sample = SceneSample(physics, observe(physics, station, *one), clouds)
        off, count = abs(sample.received().cell - sample.observed_cell(sample.view)), sample.cells.shape[1]
        right = np.minimum(off, count - off) <= CLOSE_CELLS
        result[f"{one.row['subtype']}/{one.row['model']}", station.name] = float(right.mean())
    return result


def shares_of(values: dict[str, list[float]], seed: int, *names: str) -> list:
    """Return the number of values and their mean in percent with its interval; values: lists by motion model."""
    clusters = np.array([name for name, listed in values.items() for _ in listed])
    every = np.array([value for listed in values.values() for value in listed], float)
    interval = bootstrap(clusters, every, stream(seed, "town", *names))
    return [len(every), *(f"{100 * one:.2f}" for one in interval)]


def cell_rows(seed: int) -> list[list]:
    """Return the rows of cells.csv."""
    rows = []
    for scene in SCENES:
        right = right_cells(scene)
        chosen = {part: {key for key in right if belongs(records()[key[0]])} for part, belongs in parts().items()}
        alone = {key for key in right if outside(records()[key[0]])}
        chosen |= {f"sight: {name}": {key for key in alone if sight(records()[key[0]], key[1]) == name}
                   for name in SIGHTS}  # fmt: skip
        for part, keys in chosen.items():
            values: dict[str, list[float]] = {}
            for key in sorted(keys):
                values.setdefault(key[0], []).append(right[key])
            if values:
                rows.append([part, scene, *shares_of(values, seed, "cells", part, scene)])
    return rows


def seen_rows(seed: int) -> list[list]:
    """Return the rows of seen.csv, of all motion models of the town."""
    rows = []
    for part in ("outside", "on the ground", *HEIGHTS_M):
        targets = {name: record for name, record in records().items() if parts()[part](record)}
        stations = list(next(iter(targets.values()))["paths"]["stations"])
        for station, rays in product(stations, SIGHTS):
            values = {name: [float(sight(record, station) == rays)] for name, record in targets.items()}
            rows.append([part, station, rays, *shares_of(values, seed, "seen", part, station, rays)])
    return rows


def draw(tables: Path, path: Path) -> None:
    """Draw accuracy by height and training, and by which rays the stations see targets, from the kept tables."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    accuracy, seen = (read_csv(tables / f"{name}.csv", "part") for name in ("accuracy", "seen"))
    heights = ["on the ground", *HEIGHTS_M]
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(11, 4.3), layout="constrained", width_ratios=[1.25, 1])
    asked = [("paper", "paper"), ("urban", "paper"), ("blocks", "paper"), ("blocks", "blocks")]
    for number, (scene, trained_on) in enumerate(asked):
        keys = [(part, scene, trained_on) for part in heights]
        rows = [next(row for row in accuracy if (row["part"], row["scene"], row["trained_on"]) == key) for key in keys]
        numbers = [[float(row[name]) for row in rows] for name in ("accuracy_percent", "low", "high")]
        value, low, high = np.clip(numbers, 0.0, 100.0)
        where = np.arange(len(heights)) + 0.2 * (number - 1.5)
        left.bar(where, value, 0.18, color=f"C{number}", label=f"tried in {scene}, trained in {trained_on}")
        left.errorbar(where, value, [value - low, high - value], fmt="none", ecolor="0.3", linewidth=0.8)
    left.set(xticks=range(len(heights)), ylabel="right answers (%)", ylim=(0, 105))
    names = [part.replace(" over", "\nover").replace(" and more", "\nand more") for part in heights]
    left.set_xticklabels(names, fontsize=8)
    stations = list(dict.fromkeys(row["station"] for row in seen))
    places = list(product(heights, stations))
    bottom = np.zeros(len(places))
    for number, rays in enumerate(SIGHTS):
        shares = np.array([float(next(row["percent"] for row in seen
                                      if (row["part"], row["station"], row["rays"]) == (part, station, rays)))
                           for part, station in places])  # fmt: skip
        where = [heights.index(part) + 0.28 * (stations.index(station) - 1) for part, station in places]
        right.bar(where, shares, 0.25, bottom=bottom, color=("C2", "C1", "0.7")[number], label=rays)
        bottom += shares
    for part, station in places:
        right.text(heights.index(part) + 0.28 * (stations.index(station) - 1), 2, station, ha="center", fontsize=8)
    right.set(xticks=range(len(heights)), ylabel="targets (%)", title="rays from a station to them")
    right.set_xticklabels(names, fontsize=8)
    for axes, columns in ((left, 2), (right, 3)):
        axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=columns)
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=110)


def main(arguments: list[str]) -> None:
    """Train, evaluate, and write the tables and the figure."""
    line = argparse.ArgumentParser("accuracies.py", description=__doc__.splitlines()[0])
    line.add_argument("--out", type=Path, default=HERE / "results", help="folder of the tables")
    line.add_argument("--figure", type=Path, help="picture to write (.png)")
    given = line.parse_args(arguments)
    seed, shares = config_of("blocks")["seed"], ("percent", "low", "high")
    write_csv(given.out / "seen.csv", ("part", "station", "rays", "targets", *shares), seen_rows(seed))
    write_csv(given.out / "cells.csv", ("part", "scene", "signals", *shares), cell_rows(seed))
    columns = ("part", "scene", "trained_on", "motion_models", "accuracy_percent", "low", "high", "over_paper_points",
               "over_low", "over_high")  # fmt: skip
    found = evaluated(trainings.ROOT / "results/town-networks")
    write_csv(given.out / "accuracy.csv", columns, accuracies(found, seed))
    if given.figure:
        draw(given.out, given.figure)


if __name__ == "__main__":
    run(main)
