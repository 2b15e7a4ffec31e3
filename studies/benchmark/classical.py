"""Classical methods on physical features: linear ones, support-vector machines and trees, chosen on
validation alone.

Each method tries the candidates of GRID on the training samples and keeps the one with the least
cross entropy on the validation samples; the test folds are never read. Boosting rounds, at most
ROUNDS in steps of EVERY, and the temperature of the softmax over scores are chosen on validation
too.
Sources: Cortes and Vapnik, Mach. Learn. 20, 1995; Rifkin and Klautau, J. Mach. Learn. Res. 5, 2004
(one against the rest); Hoerl and Kennard, Technometrics 12, 1970 (ridge); Friedman, Ann. Stat. 29,
2001; Chen and Guestrin, XGBoost, 2016; Breiman, Mach. Learn. 45, 2001 (forests); Guo et al., 2017
(temperature).
"""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from typing import Any

import numpy as np
from scipy.linalg import solve
from scipy.optimize import minimize_scalar
from scipy.special import softmax

from lowalt.recognition.statistics import cross_entropy

GRID = {
    "svm": [{"c": c, "gamma": gamma} for c in (3.0, 30.0) for gamma in (0.3, 1.0)],
    "boosting": [{"leaves": 15, "rate": 0.1}, {"leaves": 31, "rate": 0.1}],
    "forest": [{"leaf": 1}, {"leaf": 3}],
    "logistic": [{"c": c} for c in (0.1, 1.0, 10.0)],
    "xgboost": [{"depth": 4, "rate": 0.1}, {"depth": 6, "rate": 0.1}],
    "ridge": [{"penalties": (1e2, 1e3, 1e4, 1e5)}],
}
"""Candidates of each method; gamma is relative to one over the number of features."""
ROUNDS = 200
EVERY = 25
MANY = 10
"""With so many classes or more, only the first candidate is tried, since each takes minutes."""
Scores = Callable[[np.ndarray], np.ndarray]


def constant(shares: np.ndarray, count: int) -> np.ndarray:
    """Return the same probabilities (classes,) for a number of samples."""
    return np.tile(shares, (count, 1))


def centroids(features: np.ndarray, labels: np.ndarray, classes: int) -> Scores:
    """Return the function to class probabilities that fall off with the squared distance to each
    class's mean.
    """
    mean = features.mean(0)
    scale = np.maximum(features.std(0), 1e-9)
    scaled = (features - mean) / scale
    centres = np.array([scaled[labels == label].mean(0) for label in range(classes)])
    return partial(_near, mean, scale, centres)


def _near(
    mean: np.ndarray, scale: np.ndarray, centres: np.ndarray, asked: np.ndarray
) -> np.ndarray:
    """Probabilities (B, classes) by the squared distance to each centre, in units of the
    deviations.
    """
    away = ((asked - mean) / scale)[:, None] - centres
    logits = -0.5 * (away**2).sum(-1)
    shares = np.exp(logits - logits.max(1, keepdims=True))
    return shares / shares.sum(1, keepdims=True)


def _standardised(
    decide: Scores, mean: np.ndarray, scale: np.ndarray, asked: np.ndarray
) -> np.ndarray:
    """Scores of features that are standardised first."""
    return decide((asked - mean) / scale)


def _staged(model: Any, rounds: int, asked: np.ndarray) -> np.ndarray:
    """Scores of scikit-learn's boosted trees after some rounds."""
    return next(islice(model.staged_decision_function(asked), rounds - 1, None))


def _margins(model: Any, rounds: int, asked: np.ndarray) -> np.ndarray:
    """Scores of XGBoost's trees after some rounds."""
    import xgboost

    return model.predict(xgboost.DMatrix(asked), output_margin=True, iteration_range=(0, rounds))


def _votes(model: Any, asked: np.ndarray) -> np.ndarray:
    """Scores of a random forest of 300 trees: logarithms of its smoothed votes."""
    return np.log(model.predict_proba(asked) + 1 / 300)


def _linear(
    mean: np.ndarray, scale: np.ndarray, weights: np.ndarray, share: np.ndarray, asked: np.ndarray
) -> np.ndarray:
    """Scores of least squares on standardised features."""
    return (asked - mean) / scale @ weights + share


def _probabilities(scores: Scores, temperature: float, asked: np.ndarray) -> np.ndarray:
    """Class probabilities (B, classes) of scores."""
    return softmax(temperature * scores(asked), 1)


def _svm(features: np.ndarray, labels: np.ndarray, candidate: dict, seed: int) -> Iterator[Scores]:
    """Yield the decision functions of one candidate's machines: one class against the rest, or of
    MANY classes each against each, which needs smaller machines."""
    from sklearn.multiclass import OneVsRestClassifier
    from sklearn.svm import SVC

    mean = features.mean(0)
    scale = np.maximum(features.std(0), 1e-9)
    machine = SVC(C=candidate["c"], gamma=candidate["gamma"] / features.shape[1])
    many = len(np.unique(labels)) >= MANY
    model = (machine if many else OneVsRestClassifier(machine)).fit(
        (features - mean) / scale, labels
    )
    yield partial(_standardised, model.decision_function, mean, scale)


def _boosting(
    features: np.ndarray, labels: np.ndarray, candidate: dict, seed: int
) -> Iterator[Scores]:
    """Yield the scores of scikit-learn's boosted trees of one candidate after every EVERY rounds."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    model = HistGradientBoostingClassifier(
        learning_rate=candidate["rate"],
        max_leaf_nodes=candidate["leaves"],
        max_iter=ROUNDS,
        early_stopping=False,
        random_state=seed,
    ).fit(features, labels)
    for count in range(EVERY, ROUNDS + 1, EVERY):
        yield partial(_staged, model, count)


def _xgboost(
    features: np.ndarray, labels: np.ndarray, candidate: dict, seed: int
) -> Iterator[Scores]:
    """Yield the scores of XGBoost's trees of one candidate after every EVERY rounds."""
    import xgboost

    given = {
        "objective": "multi:softprob",
        "num_class": int(labels.max()) + 1,
        "max_depth": candidate["depth"],
        "eta": candidate["rate"],
        "tree_method": "hist",
        "nthread": 1,
        "seed": seed,
        "base_score": 0.5,
    }
    model = xgboost.train(given, xgboost.DMatrix(features, labels), ROUNDS)
    for count in range(EVERY, ROUNDS + 1, EVERY):
        yield partial(_margins, model, count)


def _forest(
    features: np.ndarray, labels: np.ndarray, candidate: dict, seed: int
) -> Iterator[Scores]:
    """Yield the scores of a random forest: logarithms of its smoothed votes."""
    from sklearn.ensemble import RandomForestClassifier

    model = RandomForestClassifier(300, min_samples_leaf=candidate["leaf"], random_state=seed).fit(
        features, labels
    )
    yield partial(_votes, model)


def _logistic(
    features: np.ndarray, labels: np.ndarray, candidate: dict, seed: int
) -> Iterator[Scores]:
    """Yield the decision functions of a logistic regression on standardised features."""
    from sklearn.linear_model import LogisticRegression

    mean = features.mean(0)
    scale = np.maximum(features.std(0), 1e-9)
    model = LogisticRegression(C=candidate["c"], max_iter=300).fit(
        (features - mean) / scale, labels
    )
    yield partial(_standardised, model.decision_function, mean, scale)


def _ridge(
    features: np.ndarray, labels: np.ndarray, candidate: dict, seed: int
) -> Iterator[Scores]:
    """Yield the scores of least squares on standardised features for each penalty, whose products
    are formed once.
    """
    mean = features.mean(0)
    scale = np.maximum(features.std(0), 1e-6)
    features = (features - mean) / scale
    wanted = np.eye(int(labels.max()) + 1, dtype=features.dtype)[labels]
    share = wanted.mean(0)
    products = features.T @ features
    answers = features.T @ (wanted - share)
    for penalty in candidate["penalties"]:
        weights = solve(
            products + penalty * np.eye(len(products), dtype=products.dtype),
            answers,
            assume_a="pos",
        )
        yield partial(_linear, mean, scale, weights, share)


MAKERS = {
    "svm": _svm,
    "boosting": _boosting,
    "forest": _forest,
    "logistic": _logistic,
    "xgboost": _xgboost,
    "ridge": _ridge,
}


def fit(method: str, train: tuple, validation: tuple, seed: int) -> Scores:
    """Return the function from features (B, D) to class probabilities (B, classes) with the least
    cross entropy.

    train, validation: features (B, D) and labels (B,) of both parts; every class has training
    samples. The function can be pickled.
    """
    asked, labels = validation
    least = np.inf
    best = None
    candidates = GRID[method]
    for candidate in candidates[:1] if train[1].max() >= MANY else candidates:
        for scores in MAKERS[method](*train, candidate, seed):
            found = scores(asked)
            cost = lambda logarithm, found=found: cross_entropy(  # noqa: E731
                softmax(np.exp(logarithm) * found, 1), labels
            )
            chosen = minimize_scalar(cost, bounds=(-3, 4), method="bounded")
            if chosen.fun < least:
                least = chosen.fun
                best = (scores, float(np.exp(chosen.x)))
    scores, temperature = best
    return partial(_probabilities, scores, temperature)
