"""Scores that say how well a window fits the classes that a network knows, and how well they tell known from unknown.

A score is high for a window of a known class. A window is kept where its score is at least a threshold.
"""

import numpy as np
from scipy.special import logsumexp

from lowalt.recognition.intervals import Interval, model_weights

KEPT = 0.95
"""Share of the known windows that a threshold keeps."""


def probability(logits: np.ndarray, known: int) -> np.ndarray:
    """Return the largest probability (n,) of the first `known` classes, of logits (n, classes).

    Source: Hendrycks and Gimpel, A baseline for detecting misclassified and out-of-distribution examples, 2017.
    """
    return np.exp(logits[:, :known].max(1) - logsumexp(logits, axis=1))


def energy(logits: np.ndarray, known: int) -> np.ndarray:
    """Return the negative free energy (n,) of the first `known` classes at temperature 1, of logits (n, classes).

    Source: Liu et al., Energy-based out-of-distribution detection, 2020, Eq. 4.
    """
    return logsumexp(logits[:, :known], axis=1)


def no_extra(logits: np.ndarray, known: int) -> np.ndarray:
    """Return the log odds (n,) that a window is of one of the first `known` classes and not of the extra one."""
    return logsumexp(logits[:, :known], axis=1) - logits[:, known]


def auroc(known: np.ndarray, unknown: np.ndarray, of_known: np.ndarray, of_unknown: np.ndarray) -> float:
    """Return the area under the ROC curve: how often a known window scores above an unknown one, ties as half.

    known (n,), unknown (m,): scores; of_known, of_unknown: how often each counts.
    Source: Hanley and McNeil, The meaning and use of the area under a ROC curve, 1982.
    """
    values, place = np.unique(np.concatenate([known, unknown]), return_inverse=True)
    mine = np.bincount(place[: len(known)], of_known, len(values))
    theirs = np.bincount(place[len(known) :], of_unknown, len(values))
    below = np.cumsum(theirs) - theirs
    return float(mine @ (below + theirs / 2) / (mine.sum() * theirs.sum()))


def level(known: np.ndarray, of_known: np.ndarray, kept: float = KEPT) -> float:
    """Return the largest threshold that keeps at least the share `kept` of known windows.

    known (n,): their scores; of_known (n,): how often each counts.
    """
    order = np.argsort(-known, kind="stable")
    reached = np.cumsum(of_known[order])
    place = np.searchsorted(reached, kept * reached[-1] * (1 - 1e-12))
    return float(known[order[min(place, len(known) - 1)]])


def alarms(
    known: np.ndarray, unknown: np.ndarray, of_known: np.ndarray, of_unknown: np.ndarray, kept: float = KEPT
) -> float:
    """Return the share of unknown windows kept by the threshold that keeps `kept` of the known ones.

    Arguments as in `auroc`.
    """
    return float(np.average(unknown >= level(known, of_known, kept), weights=of_unknown))


def _drawn(motion: np.ndarray, subtype: np.ndarray, whole: bool, repeats: int, generator: np.random.Generator):
    """How often each window is drawn, (repeats, n), where motion models are drawn, within drawn subtypes if `whole`."""
    _, first, place = np.unique(motion, return_index=True, return_inverse=True)
    return model_weights(subtype[first], whole, repeats, generator)[:, place]


def measured(
    scores: np.ndarray, known: np.ndarray, motion: np.ndarray, subtype: np.ndarray, generator: np.random.Generator,
    repeats: int = 400,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return AUROC and alarms at `KEPT`, (2,), means over seeds, and the same of every repeat, (repeats, 2).

    scores (seeds, n): of the same windows by every training seed; known (n,): which are of known classes; motion,
    subtype (n,): names of their motion models and subtypes. Every repeat draws seeds, motion models of the known
    windows, and subtypes and motion models of the unknown ones.
    """
    mine = _drawn(motion[known], subtype[known], False, repeats, generator)
    theirs = _drawn(motion[~known], subtype[~known], True, repeats, generator)
    seeds = generator.integers(0, len(scores), (repeats, len(scores)))

    def both(row: np.ndarray, of_known: np.ndarray, of_unknown: np.ndarray) -> list[float]:
        """AUROC and alarms of one seed."""
        given = row[known], row[~known], of_known, of_unknown
        return [auroc(*given), alarms(*given)]

    every = np.ones(int(known.sum())), np.ones(int((~known).sum()))
    value = np.mean([both(row, *every) for row in scores], axis=0)
    found = np.empty((repeats, 2))
    for repeat in range(repeats):
        by_seed = {seed: both(scores[seed], mine[repeat], theirs[repeat]) for seed in set(seeds[repeat].tolist())}
        found[repeat] = np.mean([by_seed[seed] for seed in seeds[repeat].tolist()], axis=0)
    return value, found


def interval(value: float, found: np.ndarray) -> Interval:
    """Return a value with the bounds of its 95 % interval, of its repeats (repeats,)."""
    return Interval(float(value), *map(float, np.quantile(found, [0.025, 0.975])))
