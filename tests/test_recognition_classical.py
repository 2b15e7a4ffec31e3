"""Classical models: their arrays give the libraries' own answers, choices see no test sample, files are read back."""

import copy
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.measure import network_speed
from lowalt.recognition import checkpoint, classical, runs, schemes, slow_time
from signal_trainings import share_right, sources, write_signals
from trainings import SETTINGS

METHODS = tuple(classical.MAKERS)
pytest.importorskip("sklearn")
pytest.importorskip("xgboost")


def scheme(method):
    row = {"scheme": f"ABC:{method}", "stations": "ABC", "spectra": "", "fusion": "concatenation", "backbone": ""}
    return schemes.scheme({**row, "protocols": "seen", "method": method}, "test", "ABC")


def samples(count=300, classes=3):
    rng = stream(1, "points")
    labels = rng.integers(0, classes, count)
    return (labels[:, None] + 0.7 * rng.standard_normal((count, 5))).astype(np.float32), labels


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(classical, "ROUNDS", 50)
    monkeypatch.setattr(classical, "GRID", {name: grid[:2] for name, grid in classical.GRID.items()})


@pytest.mark.parametrize("classes", [2, 3])
def test_trees_as_arrays_give_scikit_learns_probabilities(quick, classes):
    from sklearn.ensemble import HistGradientBoostingClassifier

    features, labels = samples(classes=classes)
    *_, model = classical._boosting(features, labels, classes, {"leaves": 15, "rate": 0.1}, 1)
    own = HistGradientBoostingClassifier(
        learning_rate=0.1, max_leaf_nodes=15, max_iter=50, early_stopping=False, random_state=1
    ).fit(features, labels)
    np.testing.assert_allclose(model(torch.from_numpy(features)[:, None]).exp(), own.predict_proba(features), atol=1e-6)


def test_trees_as_arrays_give_xgboosts_probabilities(quick):
    import xgboost

    features, labels = samples()
    given = {"objective": "multi:softprob", "num_class": 3, "max_depth": 4, "eta": 0.1, "tree_method": "hist"}
    own = xgboost.train({**given, "nthread": 1, "seed": 1, "base_score": 0.5}, xgboost.DMatrix(features, labels), 50)
    *_, model = classical._xgboost(features, labels, 3, {"depth": 4, "rate": 0.1}, 1)
    found = model(torch.from_numpy(features)[:, None]).exp()
    np.testing.assert_allclose(found, own.predict(xgboost.DMatrix(features)), atol=1e-5)


def test_vectors_as_arrays_give_scikit_learns_decisions():
    from sklearn.svm import SVC

    features, labels = samples()
    (model,) = classical._svm(features, labels, 3, {"c": 3.0, "gamma": 1.0}, 1)
    features = features.astype(float)
    scaled = (features - features.mean(0)) / features.std(0)
    for label in range(3):
        own = SVC(C=3.0, gamma=0.2).fit(scaled, labels == label).decision_function(scaled)
        np.testing.assert_allclose(model.scores(torch.from_numpy(features))[:, label], own, atol=1e-4)


@pytest.mark.parametrize("method", METHODS)
def test_a_training_leaves_the_files_of_a_network_and_its_model_predicts(quick, method, tmp_path):
    path = write_signals(tmp_path / "a.npz", 40)
    runs.train(sources(path, "features"), scheme(method), "seen", SETTINGS, tmp_path / "out")
    assert (tmp_path / "out/history.csv").read_text().startswith("candidate,rounds,validation_loss")
    trained = runs.load(tmp_path / "out/model.pt")
    assert share_right(trained, path, "features", "auto", tmp_path / "out.csv") > 0.9
    # Nothing in the file is code: it loads as tensors and plain values alone.
    assert checkpoint.load(tmp_path / "out/model.pt")[1]["scheme"]["method"] == method


@pytest.mark.parametrize("method", METHODS)
def test_the_choice_is_that_of_least_loss_on_validation(quick, method, tmp_path):
    given = sources(write_signals(tmp_path / "a.npz", 40), "features")
    model, history = classical.fit(given, method, 4, 1, ("x",))
    least = min(loss for _, _, loss, _ in history)
    judged = given["validation"]
    found = model(torch.from_numpy(judged.values)).exp()[range(len(judged.facts)), judged.facts.label]
    assert float(-found.log().mean()) == pytest.approx(least, rel=1e-6)
    lacking = {**given, "train": copy.copy(given["train"])}
    lacking["train"].keep(np.flatnonzero(given["train"].facts.label > 0))
    with pytest.raises(InputError, match="expected all of 4"):
        classical.fit(lacking, method, 4, 1, ("x",))


def test_the_candidates_are_those_of_the_kept_trainings():
    """Another candidate, another number of rounds or of SNRs would choose another model on the same samples."""
    rates = (
        [{"rate": 0.1, "leaves": leaves} for leaves in (15, 31)],
        [{"rate": 0.1, "depth": depth} for depth in (4, 6)],
    )
    machines = [{"c": c, "gamma": gamma} for c in (3, 30) for gamma in (0.3, 1)]
    assert {"svm": machines, "boosting": rates[0], "xgboost": rates[1]} == classical.GRID
    assert (classical.ROUNDS, classical.EVERY, classical.LEVELS) == (200, 25, 3)


def test_a_model_is_offered_after_every_twenty_five_rounds_with_the_trees_so_far():
    """Sixty rounds of a tree for each of two classes, each tree a leaf that adds its round's number."""
    leaf = {"feature": np.zeros(1), "threshold": np.zeros(1), "left": -np.ones(1), "right": -np.ones(1)}
    trees = [[{**leaf, "value": np.array([sign * number])} for sign in (1.0, -2.0)] for number in range(1, 61)]
    models = list(classical._rounds(trees, np.array([0.5, 0.0])))
    sums = [25 * 26 / 2, 50 * 51 / 2]
    given = torch.zeros(3, 1, dtype=torch.float64)
    assert [model.scores(given).tolist() for model in models] == [[[0.5 + total, -2 * total]] * 3 for total in sums]


def test_a_missing_package_is_named_with_the_extra_that_has_it(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "sklearn.svm", None)
    with pytest.raises(InputError, match=r"lowalt\[methods\]"):
        classical._needed("sklearn.svm")


def test_a_trained_classical_model_is_timed_as_it_is(quick, tmp_path, monkeypatch):
    runs.train(sources(write_signals(tmp_path / "a.npz", 40), "features"), scheme("svm"), "seen", SETTINGS, tmp_path)
    found = network_speed.measure(scheme("svm"), SETTINGS, 0.05, str(tmp_path / "model.pt"))
    assert 0 < found["inference_ms_64"] < found["inference_ms_1"] and found["train_ms"] is None
    assert found["backbone"] == "svm" and found["size"] == len(slow_time.NAMES)
    # Each call takes a millisecond by a clock that moves by one whenever it is read.
    ticks = iter(range(10**9))
    monkeypatch.setattr(network_speed, "_clock", lambda *_: lambda: 1e-3 * next(ticks))
    found = network_speed.measure(scheme("svm"), SETTINGS, 0.05, str(tmp_path / "model.pt"))
    assert [found[f"inference_ms_{batch}"] for batch in (1, 64)] == pytest.approx([1.0, 1 / 64], rel=1e-6)
    with pytest.raises(InputError, match="no --model"):
        network_speed.measure(scheme("svm"), SETTINGS, 0.05)


@pytest.mark.parametrize("scale", [0.1, 1.0, 10.0])
def test_the_temperature_undoes_a_factor_on_the_scores(scale):
    """Labels drawn from the softmax of known scores; a method that gives them times a factor is to be divided by it."""
    rng = np.random.default_rng(3)
    true = rng.normal(scale=2.0, size=(4000, 3))
    shares = torch.as_tensor(true).softmax(1).numpy()
    labels = (rng.random((4000, 1)) > shares.cumsum(axis=1)).sum(axis=1)
    model = SimpleNamespace(scores=lambda given: scale * given, temperature=torch.tensor(1.0, dtype=torch.float64))
    classical._tempered(model, torch.as_tensor(true), labels)
    assert float(model.temperature) * scale == pytest.approx(1.0, rel=0.1)
