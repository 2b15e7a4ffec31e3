"""Every command from clouds to the page on a few tiny samples, as the workflow calls them."""

import json
from dataclasses import replace

from craft import NETWORK, craft, row
from lowalt.config.network import station_names
from lowalt.motion import write_table
from lowalt.recognition import schemes
from lowalt.targets.cloud import write as write_cloud
from lowalt.targets.records import load_table

WAVE = NETWORK | {"subcarriers": 64, "symbols": 24, "transmit_array": [4, 2], "receive_array": [4, 2]}
SPECTRA = {
    "vrp": {"window": 8, "hop": 1, "points": 16}, "trp": {"window": 4, "hop": 1, "points": 32},
    "vt": {"window": 4, "hop": 1, "speed_min_mps": -6.0, "speed_max_mps": 6.0, "speed_step_mps": 0.5},
}  # fmt: skip
IMAGES = {"size": 32, "scale": "power", "floor_db": 40.0, "gamma": 0.5, "colour_map": "viridis"}
SPLIT = {"by": "motion", "train": 3, "val": 1, "test": 1}
TARGETS = {"DJI Mini 2": "UAV", "Crow": "Bird", "NIO ET5T 2023": "Vehicle", "Walking Pedestrian 1": "Pedestrian"}
"""Class of each subtype; all have the same craft for a body."""
SNRS = [8, "inf"]
SIZE = 32
TRAINING = {
    "steps": 2, "batch": 4, "validate_every": 1, "warmup": 0.5, "workers": 0, "threads": 1, "precision": "fp32",
    "compile": False, "snrs_per_model": 1, "patience": 0,
}  # fmt: skip


def run(stage, *arguments, **settings):
    """One command of a stage, as `python -m lowalt.STAGE` runs it."""
    module = __import__(f"lowalt.{stage}.__main__", fromlist=["main"])
    line = [str(text) for text in arguments]
    command = [line.pop(0)] if line and not line[0].startswith("-") else []
    module.main([*command, "--settings", json.dumps(settings), *line])


def classes_of(targets):
    """The classes of targets in the order of their first subtypes."""
    return list(dict.fromkeys(targets.values()))


def simulated(folder, network, targets=TARGETS):
    """Clouds, motion, echoes, noise, tiles and shards of the targets, five motion models each."""
    for name, category in targets.items():
        cloud = craft()
        record = cloud.record | {"subtype": name, "category": category, "like": "UAV"}
        write_cloud(folder / f"{name}.npz", replace(cloud, record=record))
    rows = [
        row(model) | {"subtype": name, "category": category} for model in range(5) for name, category in targets.items()
    ]
    write_table(folder / "motion.csv", rows)
    clouds, stations = [folder / f"{name}.npz" for name in targets], station_names(network)
    echoes = [folder / f"{name}.npy" for name in stations]
    chain = ("--motion", folder / "motion.csv")
    run("echo", *chain, "--clouds", *clouds, "--station", *stations, "--out", *echoes, network=network, tolerance=None)
    run("noise", *chain, "--echoes", *echoes, "--out", folder / "noisy.npy", seed=1, stations=stations, snr_db=SNRS)
    render = {"network": network, "spectra": SPECTRA, "images": IMAGES}
    run("tiles", "--signals", folder / "noisy.npy", "--out", folder / "tiles.npz", **render)
    shards = []
    for fold in ("train", "val", "test"):
        shards.append(folder / f"seen-{fold}-00000.tar")
        run(
            "shards", "write", *chain, "--signals", folder / "noisy.npy", "--tiles", folder / "tiles.npz",
            "--fold", fold,
            "--out", shards[-1], seed=1, network=network, snr_db=SNRS, split=SPLIT, shards={"kind": "image"},
            classes=classes_of(targets),
        )  # fmt: skip
    run("shards", "index", "--shards", *shards, "--out", folder / "index.json", **render, classes=classes_of(targets))
    return clouds


def recognised(folder, network, config, clouds, targets=TARGETS):
    """Views, a training of two steps, predictions and all tables."""
    block, stations = config["recognition"], station_names(network)
    index = ("--index", folder / "index.json")
    views = []
    for fold in ("train", "val", "test"):
        views.append(folder / f"views-{fold}.npz")
        run("recognition", "views", *index, "--shard", f"seen-{fold}-00000.tar", "--out", views[-1], size=SIZE)
    name = schemes.joined(stations) + ":VRP+VT"
    table = folder / "schemes.csv"
    table.write_text(
        ",".join(schemes.COLUMNS) + "\nelsewhere,Z,VRP,mean,,seen"
        f"\n{name},{schemes.joined(stations)},VRP+VT,attention,,seen\n"
    )
    settings = {
        "seed": 1, "size": SIZE, "colour_map": "viridis", "network": block["network"] | {"backbone": "test_vit2"},
        "training": block["training"] | TRAINING, "augmentation": block["augmentation"],
        "classes": classes_of(targets),
    }  # fmt: skip
    run(
        "recognition", "train", "--views", *views, "--protocol", "seen", "--out", folder / "model",
        scheme=schemes.named(table, name, list(stations)).record, **settings,
    )  # fmt: skip
    evaluation = {"batch": 8, "threads": 1, "precision": "fp32", "mirror": False}
    model = ("--model", folder / "model/model.safetensors")
    run("recognition", "evaluate", "--views", *views, *model, "--out", folder / "p.csv", **evaluation)
    run("recognition", "evaluate", *index, *model, "--out", folder / "direct.csv", **evaluation)
    assert (folder / "p.csv").read_bytes() == (folder / "direct.csv").read_bytes()
    run("recognition", "tables", "--predictions", folder / "p.csv", "--schemes", table, "--out", folder, seed=1)
    run(
        "recognition", "distances", "--clouds", *clouds, "--motion", folder / "motion.csv", "--out",
        folder / "distances.csv",
    )  # fmt: skip
    return name


def reported(folder, config, clouds, published=None):
    """The page of the run, as text."""
    job = {"rule_name": "echo", "wildcards": {}, "s": 2.0, "cpu_time": 1.5, "max_rss": 100.0}
    (folder / "echo.jsonl").write_text(json.dumps(job))
    names = ("accuracy", "confusion_by_snr", "subtypes", "comparisons", "orderings", "seeds", "distances")
    manifest = {name: str(folder / f"{name}.csv") for name in names}
    manifest |= {"index": str(folder / "index.json")}
    manifest |= {"clouds": list(map(str, clouds)), "benchmarks": [str(folder / "echo.jsonl")]}
    (folder / "report.json").write_text(json.dumps(manifest))
    published = published or load_table("config/targets.csv")
    run(
        "report", "--manifest", folder / "report.json", "--stages", folder / "stages.csv", "--figures",
        folder / "figures", "--out", folder / "report.html", config=config, published=published,
    )  # fmt: skip
    return (folder / "report.html").read_text()
