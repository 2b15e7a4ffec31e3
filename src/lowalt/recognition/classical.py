"""Classical methods on physical features: support-vector machines and boosted trees, chosen on validation alone.

Each method tries the candidates of GRID on the training samples and keeps the one with the least cross entropy on the
validation samples; the test folds are never read. Of each motion model as many SNRs are trained on as LEVELS says,
drawn by the training seed. scikit-learn and XGBoost are imported only here, and only by the method that needs them.
"""

import json
from collections.abc import Iterator

import numpy as np
import torch

from lowalt.common.errors import InputError
from lowalt.common.streams import digest
from lowalt.recognition.classical_models import Classical, Trees, Vectors, padded
from lowalt.recognition.order import epoch_order
from lowalt.recognition.statistics import cross_entropy

GRID = {
    "svm": [{"c": c, "gamma": gamma} for c in (3.0, 30.0) for gamma in (0.3, 1.0)],
    "boosting": [{"leaves": 15, "rate": 0.1}, {"leaves": 31, "rate": 0.1}],
    "xgboost": [{"depth": 4, "rate": 0.1}, {"depth": 6, "rate": 0.1}],
}
"""Candidates of each method; gamma is relative to one over the number of features. The number of boosting rounds, at
most ROUNDS in steps of EVERY, is chosen on validation too."""
ROUNDS, EVERY = 200, 25
LEVELS = 3
"""SNRs of each motion model that train."""
HISTORY = ("candidate", "rounds", "validation_loss", "validation_accuracy")


def _needed(name: str):
    """Import a package of the extra `methods`. Raises: InputError where it is not installed."""
    try:
        return __import__(name, fromlist=["_"])
    except ImportError as error:
        raise InputError(f"method: no package for it ({error}), expected `pip install 'lowalt[methods]'`") from error


def _svm(features: np.ndarray, labels: np.ndarray, classes: int, candidate: dict, seed: int) -> Iterator[Classical]:
    """Yield the machines of one candidate."""
    svm, features = _needed("sklearn.svm"), features.astype(float)
    mean, scale = features.mean(0), np.maximum(features.std(0), 1e-9)
    scaled, gamma = (features - mean) / scale, candidate["gamma"] / features.shape[1]
    machines = [svm.SVC(C=candidate["c"], gamma=gamma).fit(scaled, labels == label) for label in range(classes)]
    used = np.unique(np.concatenate([machine.support_ for machine in machines]))
    weights = np.zeros((len(used), classes))
    for label, machine in enumerate(machines):
        weights[np.searchsorted(used, machine.support_), label] = machine.dual_coef_[0]
    yield Vectors(
        mean=mean, scale=scale, support=scaled[used], weights=weights, gamma=np.array(gamma),
        offset=np.array([machine.intercept_[0] for machine in machines]), temperature=np.array(1.0),
    )  # fmt: skip


def _rounds(trees: list[list[dict]], offset: np.ndarray) -> Iterator[Trees]:
    """Yield the model after every EVERY rounds; trees: by round, then by class."""
    for count in range(EVERY, len(trees) + 1, EVERY):
        kept = [(tree, label) for round_ in trees[:count] for label, tree in enumerate(round_)]
        yield padded([tree for tree, _ in kept], [label for _, label in kept], offset)


def _boosting(features: np.ndarray, labels: np.ndarray, classes: int, candidate: dict, seed: int) -> Iterator[Trees]:
    """Yield scikit-learn's boosted trees of one candidate after every EVERY rounds."""
    ensemble = _needed("sklearn.ensemble")
    model = ensemble.HistGradientBoostingClassifier(
        learning_rate=candidate["rate"], max_leaf_nodes=candidate["leaves"], max_iter=ROUNDS, early_stopping=False,
        random_state=seed,
    ).fit(features, labels)  # fmt: skip

    def arrays(nodes: np.ndarray) -> dict[str, np.ndarray]:
        """Return the arrays of one tree of scikit-learn's nodes."""
        leaf = nodes["is_leaf"].astype(bool)
        return {
            "feature": nodes["feature_idx"], "threshold": nodes["num_threshold"], "value": nodes["value"],
            "left": np.where(leaf, -1, nodes["left"].astype(np.int64)), "right": nodes["right"],
        }  # fmt: skip

    trees = [[arrays(tree.nodes) for tree in round_] for round_ in model._predictors]
    if classes == 2:
        # One tree a round then scores the second class; the first stays at zero.
        trees = [[{**tree, "value": 0 * tree["value"]}, tree] for (tree,) in trees]
        yield from _rounds(trees, np.array([0.0, float(model._baseline_prediction.ravel()[0])]))
        return
    yield from _rounds(trees, model._baseline_prediction.ravel())


def _xgboost(features: np.ndarray, labels: np.ndarray, classes: int, candidate: dict, seed: int) -> Iterator[Trees]:
    """Yield XGBoost's trees of one candidate after every EVERY rounds."""
    xgboost = _needed("xgboost")
    given = {
        "objective": "multi:softprob", "num_class": classes, "max_depth": candidate["depth"], "eta": candidate["rate"],
        "tree_method": "hist", "nthread": 1, "seed": seed % 2**31, "base_score": 0.5,
    }  # fmt: skip
    booster = xgboost.train(given, xgboost.DMatrix(features, labels), ROUNDS)
    model = json.loads(booster.save_raw("json"))["learner"]["gradient_booster"]["model"]
    trees = []
    for tree in model["trees"]:
        limit = np.array(tree["split_conditions"], np.float32)
        left = np.array(tree["left_children"])
        trees.append({
            "feature": np.array(tree["split_indices"]), "left": left, "right": np.array(tree["right_children"]),
            # Its samples go left where a float32 value is below the limit: at most the next smaller float32.
            "threshold": np.nextafter(limit, np.float32(-np.inf)).astype(float),
            "value": np.where(left < 0, limit, 0).astype(float),
        })  # fmt: skip
    rounds = [trees[start : start + classes] for start in range(0, len(trees), classes)]
    # A score that all classes share changes no probability.
    yield from _rounds(rounds, np.zeros(classes))


MAKERS = {"svm": _svm, "boosting": _boosting, "xgboost": _xgboost}


def _tempered(model: Classical, features: torch.Tensor, labels: np.ndarray) -> None:
    """Set the temperature that gives the least cross entropy on validation samples; no guess changes."""
    # Trainings of networks import this module too, and SciPy's optimisers take half a second to import.
    from scipy.optimize import minimize_scalar

    with torch.inference_mode():
        scores = model.scores(features.flatten(1).double())

    def loss(logarithm: float) -> float:
        """Return the cross entropy at exp(logarithm)."""
        return cross_entropy((np.exp(logarithm) * scores).softmax(-1).numpy(), labels)

    model.temperature.fill_(float(np.exp(minimize_scalar(loss, bounds=(-3, 4), method="bounded").x)))


def fit(samples: dict, method: str, classes: int, seed: int, keys: tuple) -> tuple[Classical, list[tuple]]:
    """Return the model with the least cross entropy on validation, and a row of HISTORY for every model tried.

    samples: the sources "train" and "validation", of features; seed, keys: name the stream of SNRs drawn.
    Raises: InputError where the method's package is not installed, or a class has no training sample.
    """
    train, validation = samples["train"], samples["validation"]
    numbers = epoch_order(train.facts, seed, keys, 0, LEVELS)
    features, labels = train.views(numbers).reshape(len(numbers), -1), train.facts.label[numbers]
    if set(labels.tolist()) != set(range(classes)):
        raise InputError(f"training: samples of the labels {sorted(set(labels.tolist()))}, expected all of {classes}")
    judged = torch.from_numpy(validation.views(np.arange(len(validation.facts))))
    number = int.from_bytes(digest(seed, "classical", *keys)[:4], "little")
    best, least, history = None, np.inf, []
    for candidate in GRID[method]:
        words = " ".join(f"{key}={value}" for key, value in candidate.items())
        for step, model in enumerate(MAKERS[method](features, labels, classes, candidate, number), start=1):
            _tempered(model, judged, validation.facts.label)
            with torch.inference_mode():
                shares = model(judged).exp().numpy()
            loss = cross_entropy(shares, validation.facts.label)
            accuracy = float(np.mean(shares.argmax(1) == validation.facts.label))
            history.append((words, 1 if method == "svm" else EVERY * step, loss, accuracy))
            if loss < least:
                best, least = model, loss
    return best, history
