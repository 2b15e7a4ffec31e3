"""A stream of fresh motion models: none repeats, none is tested, pixels are the data set's, and trainings resume."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from configured import Inputs, parts
from lowalt.common.errors import InputError
from lowalt.common.splits import fold
from lowalt.recognition import checkpoint, order, recipe, runs, schemes
from lowalt.recognition import stream as streams
from lowalt.recognition.__main__ import main
from lowalt.recognition.made import opened
from lowalt.recognition.samples import ViewSamples
from lowalt.recognition.stream import STRIDE, Stream, Streamed, streamed
from lowalt.shards.build import write_run
from lowalt.shards.dataset import Dataset
from lowalt.tiles import split
from lowalt.tiles.resample import resize
from lowalt.workflow import options
from test_dataset import configuration
from test_recognition_made import ONE_OF_EACH
from trainings import SETTINGS, TRAINING, Killed, equal, kill_at

COLUMNS, SIZE = [0, 2, 4, 6], 32
"""Views by the catalogue, whose spectra are four: images 0, 2, 3 and 5 of a data set with the first three."""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run's folder with clouds, configuration, shards and shrunk images: four classes in each group."""
    config = configuration()
    config["targets"]["select"] = ONE_OF_EACH
    config["motion"] |= {"models": 8, "models_per_chunk": 4}
    folder = tmp_path_factory.mktemp("stream") / "run"
    write_run(Dataset(config), folder, "image")
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    return folder


@pytest.fixture(scope="module")
def dataset(run):
    return opened(run / "config.yaml")


def test_no_motion_model_comes_twice_and_each_round_has_every_subtype(dataset):
    fresh = Stream(dataset, COLUMNS, SIZE, ["seen", "unseen"])
    count, plan = len(fresh.subtypes), dataset.plan
    places = [fresh.place(position) for position in range(60 * count)]
    assert len({(place.subtype, place.model) for place in places}) == len(places)
    for number in range(60):
        found = places[number * count : (number + 1) * count]
        assert {(place.group, place.subtype) for place in found} == set(fresh.subtypes)
    assert len({tuple(place.subtype for place in places[n * count : (n + 1) * count]) for n in range(60)}) > 20
    assert {place.snr_db for place in places} == set(plan.snrs)
    for place in places:
        assert place.model >= plan.models
        assert fold(plan.split, plan.seed, place.subtype, place.model, place.snr_db) == "train"
    # Half of the numbers would validate or test: those are passed over.
    assert 0.35 < np.mean([place.model >= STRIDE for place in places]) < 0.65


def test_a_limited_stream_repeats_its_motion_models_at_other_snrs(dataset):
    fresh = Stream(dataset, COLUMNS, SIZE, ["seen", "unseen"], models=21)
    count = len(fresh.subtypes)
    places = [fresh.place(position) for position in range(40 * count)]
    models = {(place.subtype, place.model % STRIDE) for place in places}
    assert len(models) == 21 // count * count
    assert len({(place.subtype, place.model % STRIDE, place.snr_db) for place in places}) == 2 * len(models)
    for models in (1, count - 1):
        with pytest.raises(InputError, match=f"stream: {models} motion models of {count} subtypes"):
            Stream(dataset, COLUMNS, SIZE, ["seen", "unseen"], models=models)


def test_images_of_models_that_repeat_are_kept_up_to_the_bound(dataset, monkeypatch):
    """The bound is three and a half images; a stream of as many models as subtypes has just one of each."""
    assert STRIDE == 2_147_483_648
    monkeypatch.setattr(streams, "views_of", lambda *given: np.zeros((4, 5), np.uint8))
    monkeypatch.setattr(streams, "CLEAN_BYTES", 70)
    for models in (0, len(Stream(dataset, COLUMNS, SIZE, ["seen"]).subtypes)):
        fresh = Stream(dataset, COLUMNS, SIZE, ["seen"], models=models)
        fresh.views(np.arange(len(fresh.subtypes)))
        assert len(fresh._made) == (3 if models else 0)
        assert fresh.__getstate__()["_made"] == {}
    monkeypatch.setattr(streams, "CLEAN_BYTES", 60)
    fresh = Stream(dataset, COLUMNS, SIZE, ["seen"], models=models)
    fresh.views(np.arange(len(fresh.subtypes)))
    assert len(fresh._made) == 2


def test_pixels_and_labels_are_those_of_the_data_set(dataset):
    fresh = Stream(dataset, COLUMNS, SIZE, ["seen"], without=["Crow"])
    positions = np.array([5, 0, 3])
    images, labels = fresh.views(positions), fresh.labels(positions)
    for position, image, told in zip(positions, images, labels, strict=True):
        place = fresh.place(position)
        made = dataset.made(place)
        assert place.group == "seen" and place.subtype != "Crow"
        assert dataset.classes[told] == made.record["category"]
        assert (image == resize(split(made.image, 3), SIZE)[[0, 2, 3, 5]]).all()


def test_batches_take_their_share_and_never_a_fresh_sample_twice():
    part = np.arange(8)
    found = [order.with_fresh(part, step, 0.25, 100) for step in range(3)]
    assert [list(batch[:6]) for batch in found] == [list(range(6))] * 3
    assert np.concatenate([batch[6:] for batch in found]).tolist() == [100, 101, 102, 103, 104, 105]
    assert order.with_fresh(part, 2, 1.0, 100).tolist() == list(range(116, 124))


def test_fixed_and_fresh_samples_come_in_the_order_asked_for_also_where_all_are_of_one_kind():
    """Fixed numbers 0 to 4 have images of 0 to 4, fresh ones, from 5 on, of 100 and more."""
    facts = type("Facts", (), {"label": np.arange(5), "__len__": lambda self: 5})()

    def images(values):
        return np.broadcast_to(values.astype(np.uint8)[:, None, None, None], (len(values), 1, 2, 2))

    fixed = SimpleNamespace(facts=facts, size=2, views=images)
    fresh = SimpleNamespace(labels=lambda some: 1000 + some, views=lambda some: images(100 + some))
    mixed = Streamed(fixed, fresh)
    for numbers in ([7, 0, 5, 4], [3, 1], [5], [9, 8, 6]):
        wanted = [number if number < 5 else 100 + number - 5 for number in numbers]
        found, labels = mixed.views(np.array(numbers)), mixed.labels(np.array(numbers))
        assert (
            found.dtype == np.uint8 and found.shape == (len(numbers), 1, 2, 2) and found[:, 0, 1, 0].tolist() == wanted
        )
        assert labels.tolist() == [number if number < 5 else 1000 + number - 5 for number in numbers]


def line(run, settings, out):
    views = [str(path) for path in sorted((run / "views").glob("*.npz"))]
    return ["train", "--settings", json.dumps(settings), "--views", *views, "--protocol", "seen", "--stations", "A",
            "B", "C", "--scheme", "AB:VRP+VT", "--schemes", str(out.parent / "schemes.csv"), "--stream",
            str(run / "config.yaml"), "--out", str(out)]  # fmt: skip


def test_a_stopped_training_on_a_stream_resumes_exactly_and_workers_change_no_bit(run, tmp_path, monkeypatch):
    for shard in sorted((run / "shards").glob("*.tar")):
        main(["views", "--settings", json.dumps({"size": SIZE}), "--index", str(run / "shards/index.json"),
              "--shard", shard.name, "--out", str(run / "views" / f"{shard.stem}.npz")])  # fmt: skip
    (tmp_path / "schemes.csv").write_text(",".join(schemes.COLUMNS) + "\nAB:VRP+VT,AB,VRP+VT,attention,,seen\n")
    training = {**TRAINING, "steps": 4, "validate_every": 2, "stream": 0.5, "checkpoint_s": 0}
    settings = {**SETTINGS, "size": SIZE, "training": training}
    main(line(run, settings, tmp_path / "whole"))
    main(line(run, {**settings, "training": {**training, "workers": 2}}, tmp_path / "workers"))
    step = kill_at(monkeypatch, 3)
    with pytest.raises(Killed):
        main(line(run, settings, tmp_path / "parts"))
    monkeypatch.setattr(runs.Trainer, "_step", step)
    main(line(run, settings, tmp_path / "parts"))
    weights = {
        name: checkpoint.load(tmp_path / name / "model.pt")[1]["weights"] for name in ("whole", "workers", "parts")
    }
    assert equal(weights["whole"], weights["workers"]) and equal(weights["whole"], weights["parts"])
    other = {**settings, "training": {**training, "stream": 0.25}}
    main(line(run, other, tmp_path / "less"))
    assert not equal(weights["whole"], checkpoint.load(tmp_path / "less/model.pt")[1]["weights"])
    with pytest.raises(InputError, match=r"stream is 0\.0, expected a share above 0"):
        main(line(run, {**settings, "training": {**training, "stream": 0.0}}, tmp_path / "none"))


def test_what_a_stream_rests_on_is_in_the_training_s_identity(run):
    views = [str(path) for path in sorted((run / "views").glob("*.npz"))]
    fixed = ViewSamples(views, COLUMNS, {("seen", "train"), ("unseen", "train")})
    sums = {
        streamed(fixed, run / "config.yaml", COLUMNS, protocol, models).sha256()
        for protocol, models in (("seen", 0), ("unseen", 0), ("seen", 70))
    }
    assert len(sums | {fixed.sha256()}) == 4


def test_the_configuration_asks_for_a_stream():
    change = {"recognition": {"training": {"stream": 1.0, "stream_models": 1000}}}
    wildcards = SimpleNamespace(scheme="a-vrp-trp-vt")
    found, plain = (parts(given)[1].training_samples(wildcards) for given in (change, {}))
    assert found["stream"] == "results/default/config.yaml" and len(found["clouds"]) == 40
    assert found["views"] == plain["views"] and not {"stream", "clouds"} & set(plain)
    assert (
        options.stream(None, Inputs({"stream": "c.yaml"})) == ["--stream", "c.yaml"]
        and options.stream(None, Inputs({})) == []
    )
    with pytest.raises(InputError, match="stream"):
        recipe.check({**TRAINING, "stream": 1.5})


def test_the_figure_of_fresh_models_is_drawn_from_the_table(tmp_path):
    from lowalt.common.csv_tables import write_csv
    from lowalt.measure.fresh_models import COLUMNS
    from lowalt.report.figures import fresh_models

    numbers = ["96", "20", "523316", "2.5", "2.7", "60", "55", "64", "90", "88", "92", "here"]
    write_csv(tmp_path / "stream.csv", COLUMNS, [["few", *numbers], ["many", "9600", *numbers[1:]]])
    fresh_models.main(["--table", str(tmp_path / "stream.csv"), "--figure", str(tmp_path / "stream.png")])
    assert (tmp_path / "stream.png").read_bytes().startswith(b"\x89PNG")
