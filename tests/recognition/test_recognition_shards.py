"""Recognition on real shards: cache and direct reading agree, facts match the records, predict and
score from files.
"""

import csv
import json
import math

import numpy as np
import pytest
import torch

import model_files
from dataset import RENDER, SNRS, build
from lowalt.config.classes import CATEGORIES
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.recognition import (
    predict_sample,
    predictions,
    recogniser,
    runs,
    samples,
    schemes,
    score,
    views,
)
from lowalt.recognition.__main__ import main
from lowalt.recognition.protocols import folds
from lowalt.shards import ShardSet
from lowalt.shards.sample_record import row_of
from lowalt.tiles import reduced, resize
from lowalt.tiles.__main__ import main as tiles_main

SIZE = 32
SCHEME = schemes.Scheme("BC:VRP+VT", (1, 2), (0, 2))
BLOCK = {
    "backbone": "test_vit2",
    "weights": "none",
    "intra_depth": 1,
    "inter_depth": 1,
    "heads": 4,
    "feed_forward": 1,
    "dropout": 0.0,
    "hidden": 0,
}


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return build(tmp_path_factory.mktemp("recognition"), "image")


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    torch.manual_seed(1)
    palettes = np.zeros((3, 256, 3), np.uint8)
    weights = recogniser.Recogniser(SCHEME, BLOCK, SIZE, palettes, 4).state_dict()
    path = tmp_path_factory.mktemp("model") / "model.safetensors"
    # The palettes are part of the weights: a model keeps the colours it was trained on.
    about = {
        "scheme": vars(SCHEME),
        "protocol": "seen",
        "network": BLOCK,
        "size": SIZE,
        "seed": 0,
        "colour_map": "gray",
    }
    weights["palettes.table"] = torch.randn(2, 256, 3)
    model_files.save(path, "{}", {"weights": weights, **about})
    return path


def cached(dataset, folder):
    paths = []
    for shard in ShardSet(dataset / "index.json").shards:
        path = folder / shard["path"].replace(".tar", ".npz")
        arguments = [
            "--index",
            str(dataset / "index.json"),
            "--shard",
            shard["name"],
            "--out",
            str(path),
        ]
        main(["views", "--settings", json.dumps({"size": SIZE}), *arguments])
        paths.append(path)
    return paths


def test_cache_and_shards_hold_the_same_samples(dataset, tmp_path):
    pairs = folds("seen", "train") | folds("seen", "test")
    memory = samples.ViewSamples(cached(dataset, tmp_path), SCHEME.columns, pairs)
    direct = views.ShardSamples(dataset / "index.json", SCHEME.columns, pairs, SIZE, placed=True)
    mine = np.argsort(memory.facts.key)
    theirs = np.argsort(direct.facts.key)
    assert len(mine) == len(theirs) > 6
    assert (memory.views(mine) == direct.views(theirs)).all()
    for name in samples.FACTS:
        one = getattr(memory.facts, name)[mine]
        other = getattr(direct.facts, name)[theirs]
        assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f"), name
    shards = ShardSet(dataset / "index.json")
    keys = [key.decode() for key in shards.keys]
    number = keys.index(str(direct.facts.key[3]))
    assert (
        direct.views(np.array([3]))[0] == resize(shards.images(number), SIZE)[[3, 5, 6, 8]]
    ).all()


def test_facts_are_those_of_the_records(dataset):
    shards = ShardSet(dataset / "index.json")
    numbers = np.arange(len(shards))[::-2]
    facts = views.facts_of(shards, numbers)
    quick = views.facts_of(shards, numbers, placed=False)
    for place, number in enumerate(numbers):
        record = shards.record(number)
        for name in ("key", "subtype", "model", "group", "fold", "label"):
            assert getattr(facts, name)[place] == record[name] == getattr(quick, name)[place]
        assert facts.snr_db[place] == row_of(record)[1]
        assert facts.range_m[place].tolist() == [
            record["geometry"][name]["range_m"] for name in "ABC"
        ]
    assert np.isnan(quick.range_m).all() and np.isfinite(facts.aspect_rad).all()


@pytest.mark.parametrize(
    ("yaw_deg", "expected_deg"), [(0, 90), (90, 0), (-90, 180), (45, 45), (135, 45)]
)
def test_aspect_is_zero_where_the_target_faces_the_station(yaw_deg, expected_deg):
    net = Network.from_settings(RENDER["network"])
    x, y, _ = net.stations[0].position_m
    # The target stands east of the first station; its front is +y turned by the yaw, so yaw 90
    # degrees looks west.
    motion = {"yaw_rad": math.radians(yaw_deg), "x_m": x + 100, "y_m": y}
    geometry = {station.name: {"range_m": 1.0} for station in net.stations}
    _, aspects = views.geometry({"motion": motion, "geometry": geometry}, net)
    assert math.degrees(aspects[0]) == pytest.approx(expected_deg, abs=1e-6)


def test_predicting_from_a_signal_and_from_its_tile_agree_with_the_network(
    dataset, model, tmp_path
):
    shards = ShardSet(dataset / "index.json")
    signals = {}
    for group in ("seen", "unseen"):
        for sample in np.load(dataset / f"{group}.npy").reshape(-1, 3, 400):
            signals[shards.renderer.tile(sample).tobytes()] = sample
    trained = runs.load(model)
    for number in (0, 5):
        (tmp_path / "tile.png").write_bytes(shards.png(number))
        np.save(tmp_path / "signal.npy", signals[shards.tile(number).tobytes()])
        given = [
            predict_sample.predict(trained, tmp_path / name, RENDER)
            for name in ("tile.png", "signal.npy")
        ]
        assert given[0] == given[1]
        assert list(given[0]) == ["UAV", "Bird", "Vehicle", "Pedestrian"]
        assert sum(given[0].values()) == pytest.approx(1, abs=1e-12)
        index = torch.from_numpy(resize(shards.images(number), SIZE)[[3, 5, 6, 8]][None])
        with torch.inference_mode():
            assert list(given[0].values()) == trained.model(index).double().softmax(1)[0].tolist()
    np.save(tmp_path / "short.npy", np.zeros((3, 10), np.complex64))
    for name, words in (("short.npy", "shape"), ("note.txt", "expected signals")):
        (tmp_path / "note.txt").write_text("")
        with pytest.raises(InputError, match=words):
            predict_sample.predict(trained, tmp_path / name, RENDER)


def test_scores_come_from_the_shards_labels_not_from_the_file(dataset, model, tmp_path):
    arguments = f"--index {dataset}/index.json --model {model} --out {tmp_path}/p.csv".split()
    settings = json.dumps({"batch": 4, "threads": 1, "precision": "fp32", "mirror": False})
    main(["evaluate", "--settings", settings, *arguments])
    ours = predictions.read(tmp_path / "p.csv").of(folds("seen", "test"))
    found = score.score(tmp_path / "p.csv", dataset / "index.json", "seen")
    assert found["samples"] == len(ours) > 0
    shares = [ours.correct[ours.snr_db == snr].mean() for snr in np.unique(ours.snr_db)]
    assert found["accuracy_percent"] == pytest.approx(100 * np.mean(shares))
    with (tmp_path / "p.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    short = [
        {name: row[name] for name in ("key", *predictions.probability_columns(CATEGORIES))}
        for row in rows
    ]

    def written(rows):
        with (tmp_path / "q.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
        return tmp_path / "q.csv"

    # Labels of the file are never looked at.
    lying = [{**row, "label": "0"} for row in rows]
    assert score.score(written(lying), dataset / "index.json", "seen") == found
    assert score.score(written(short[::-1]), dataset / "index.json", "seen") == found
    tested = next(row for row in rows if row["key"] == ours.key[0])
    others = [row for row in short if row["key"] != tested["key"]]
    sure = {"key": tested["key"], "p_uav": 1, "p_bird": 0, "p_vehicle": 0, "p_pedestrian": 0}
    for wrong, words in (
        ([], f"1 test samples have no prediction, the first is '{tested['key']}'"),
        ([sure, sure], "stands twice"),
        ([sure | {"p_bird": 0.2}], "with sum 1"),
        ([sure | {"p_uav": 1.1, "p_bird": -0.1}], "with sum 1"),
        ([sure | {"p_bird": "x"}], "line 2"),
    ):
        with pytest.raises(InputError, match=words):
            score.score(written([*wrong, *others]), dataset / "index.json", "seen")
    with pytest.raises(InputError, match="lacks the columns"):
        score.score(written([{"key": row["key"]} for row in rows]), dataset / "index.json", "seen")


def test_scores_count_every_snr_alike():
    """Three samples of two classes: one right, one wrong at 3 dB, one right without noise."""
    unused = dict.fromkeys(("key", "model", "group", "fold", "range_m", "aspect_rad"), np.zeros(3))
    names = np.array(["Crow", "Owl", "Owl"])
    snrs = np.array([3.0, 3.0, np.inf])
    facts = samples.Facts(label=np.array([0, 1, 1]), snr_db=snrs, subtype=names, **unused)
    found = score.scores(facts, np.array([[0.9, 0.1], [0.6, 0.4], [0.2, 0.8]]))
    assert found["accuracy_percent"] == 75 and found["by_snr_percent"] == {"3": 50.0, "inf": 100.0}
    assert found["by_subtype_percent"] == {"Crow": 100.0, "Owl": 50.0} and found["confusion"] == [
        [1, 0],
        [1, 1],
    ]
    assert found["confusion_by_snr"] == {"3": [[1, 0], [1, 0]], "inf": [[0, 0], [0, 1]]}
    assert found["brier"] == pytest.approx((0.02 + 0.72 + 0.08) / 3)


def test_unknown_shards_and_sizes_are_refused(dataset, tmp_path):
    with pytest.raises(InputError, match="no shard 'seen-dev'"):
        views.cache_shard(dataset / "index.json", "seen-dev", 32, tmp_path / "x.npz")
    with pytest.raises(InputError, match="size is 4"):
        views.cache_shard(dataset / "index.json", "seen-train-00000.tar", 4, tmp_path / "x.npz")
    with pytest.raises(InputError, match="no samples"):
        views.ShardSamples(dataset / "index.json", [0], set(), 32, placed=False)


def reduce_tiles(dataset, folder, group, sizes):
    """Run the tiles stage over a group's signals with reduced images; the options of `views` by
    size.
    """
    targets = [f"{size}={folder / f'{group}-{size}.npy'}" for size in sizes]
    files = [
        "--signals",
        str(dataset / f"{group}.npy"),
        "--out",
        str(folder / "tiles.npz"),
        "--reduced",
        *targets,
    ]
    tiles_main(["--settings", json.dumps(RENDER), *files])
    motion = ["--motion", str(dataset / f"{group}.csv")]
    return {size: ["--reduced", str(folder / f"{group}-{size}.npy"), *motion] for size in sizes}


@pytest.mark.parametrize("size", [SIZE, 24])
def test_views_from_the_tiles_stage_are_those_from_decoded_images_byte_for_byte(
    dataset, tmp_path, size
):
    for shard in ShardSet(dataset / "index.json").shards:
        given = reduce_tiles(dataset, tmp_path, shard["group"], (SIZE, 24))[size]
        same = ["--index", str(dataset / "index.json"), "--shard", shard["name"], "--out"]
        main(
            [
                "views",
                "--settings",
                json.dumps({"size": size}),
                *same,
                str(tmp_path / "decoded.npz"),
            ]
        )
        settings = json.dumps({"size": size, "snr_db": SNRS})
        main(["views", "--settings", settings, *given, *same, str(tmp_path / "reduced.npz")])
        assert (tmp_path / "reduced.npz").read_bytes() == (tmp_path / "decoded.npz").read_bytes()


def test_reduced_images_of_another_size_chunk_or_snr_are_refused_by_name(dataset, tmp_path):
    options = reduce_tiles(dataset, tmp_path, "seen", (24,))[24]
    other = reduce_tiles(dataset, tmp_path, "unseen", (24,))[24]
    mixed = [*other[:2], *options[2:]]
    same = (
        f"--index {dataset}/index.json --shard seen-train-00000.tar --out {tmp_path}/x.npz".split()
    )
    for size, levels, given, words in (
        (32, SNRS, options, r"seen-24\.npy: uint8 .* expected uint8 \(16, views, 32, 32\)"),
        (24, SNRS, mixed, r"unseen-24\.npy"),
        (24, [3, 5], options, r"no motion model or SNR inf"),
        (24, SNRS, other, "no motion model or SNR"),
        (24, SNRS, options[:2], "both --reduced and --motion"),
        (
            24,
            SNRS,
            ["--reduced", str(tmp_path / "tiles.npz"), *options[2:]],
            r"tiles\.npz: an archive of arrays, expected reduced images",
        ),
    ):
        with pytest.raises(InputError, match=words):
            main(
                ["views", "--settings", json.dumps({"size": size, "snr_db": levels}), *given, *same]
            )
    assert not (tmp_path / "x.npz").exists()
    for text in ("24", "=x.npy", "0=x.npy"):
        with pytest.raises(InputError, match="expected SIZE=PATH"):
            reduced.target(text)
