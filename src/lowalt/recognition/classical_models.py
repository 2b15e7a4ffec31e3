"""Trained classical models as plain arrays: support vectors, and boosted trees. They need no scikit-learn or XGBoost.

Both are torch modules from features (B, K, F) to logarithms of class probabilities (B, classes), so they are saved,
read back (no code in the file) and evaluated as networks are.
"""

import numpy as np
import torch
from torch import nn

from lowalt.common.errors import InputError


class Classical(nn.Module):
    """A model of arrays alone; features of all stations stand one after the other."""

    ARRAYS: tuple[str, ...] = ()

    def __init__(self, **arrays: np.ndarray | torch.Tensor) -> None:
        """arrays: one for each name of ARRAYS, all float64 or int64.

        Raises: InputError where a name is missing or unknown.
        """
        super().__init__()
        if set(arrays) != set(self.ARRAYS):
            raise InputError(f"classical model: arrays {sorted(arrays)}, expected {sorted(self.ARRAYS)}")
        for name, value in arrays.items():
            self.register_buffer(name, torch.as_tensor(value))

    @property
    def classes(self) -> int:
        """Number of classes."""
        return len(self.offset)

    @staticmethod
    def mirrored(features: torch.Tensor) -> torch.Tensor:
        """Return the features: a target turned by 180 degrees has the same."""
        return features

    def check(self, features: int, classes: int) -> None:
        """Refuse arrays of a file that do not fit together.

        features: numbers of a sample; classes: their number. Raises: InputError.
        """
        try:
            good = self._fits(features) and self.classes == classes
        except (TypeError, ValueError, IndexError, RuntimeError):
            good = False
        if not good:
            raise InputError(f"its arrays do not fit together, {features} features and {classes} classes")

    def _fits(self, features: int) -> bool:
        """Whether the arrays fit together and to samples of so many features."""
        raise NotImplementedError

    def scores(self, features: torch.Tensor) -> torch.Tensor:
        """Features (B, D) float64 -> scores (B, classes)."""
        raise NotImplementedError

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """Features (B, K, F) -> logarithms of class probabilities (B, classes) float64."""
        scores = self.scores(features.flatten(1).double())
        return (self.temperature * scores).log_softmax(-1)


class Vectors(Classical):
    """Support-vector machines with a Gaussian kernel, one class against the rest.

    mean, scale (D,): of the features; support (S, D): scaled support vectors; weights (S, classes), offset (classes,):
    of the decision functions; gamma (): kernel exp(-gamma |x - s|^2); temperature (): of the softmax over decisions.
    Source: Cortes and Vapnik, Mach. Learn. 20, 1995; Rifkin and Klautau, J. Mach. Learn. Res. 5, 2004 (one against the
    rest); Guo et al., On calibration of modern neural networks, 2017 (temperature).
    """

    ARRAYS = ("mean", "scale", "support", "weights", "offset", "gamma", "temperature")

    def _fits(self, features: int) -> bool:
        """As `Classical._fits`."""
        count, classes = len(self.support), len(self.offset)
        wanted = ((features,), (features,), (count, features), (count, classes), (classes,), (), ())
        arrays = [getattr(self, name) for name in self.ARRAYS]
        return all(array.shape == shape and array.dtype == torch.float64
                   for array, shape in zip(arrays, wanted, strict=True))  # fmt: skip

    def scores(self, features: torch.Tensor) -> torch.Tensor:
        """Features (B, D) float64 -> decision functions (B, classes)."""
        scaled = (features - self.mean) / self.scale
        apart = torch.cdist(scaled, self.support).square()
        return torch.exp(-self.gamma * apart) @ self.weights + self.offset


class Trees(Classical):
    """Boosted decision trees; the scores of a class are sums of the leaves of its trees.

    feature, left, right (T, nodes) int64, threshold, value (T, nodes): a sample goes left where its feature is at most
    the threshold; a leaf points to itself; label (T,): each tree's class; offset (classes,): scores before any tree;
    depth (): steps that reach every leaf; temperature (): of the softmax over scores.
    Source: Friedman, Ann. Stat. 29, 2001; Ke et al., LightGBM, 2017 (histograms); Chen and Guestrin, XGBoost, 2016.
    """

    ARRAYS = ("feature", "threshold", "left", "right", "value", "label", "offset", "depth", "temperature")

    def _fits(self, features: int) -> bool:
        """As `Classical._fits`, with all numbers of nodes, features and classes in range."""
        trees, nodes = self.feature.shape
        limits = {"feature": features, "left": nodes, "right": nodes, "label": len(self.offset), "depth": nodes + 1}
        shapes = {"label": (trees,), "offset": (len(self.offset),), "depth": (), "temperature": ()}
        return all(
            array.shape == shapes.get(name, (trees, nodes))
            and array.dtype == (torch.int64 if name in limits else torch.float64)
            and (name not in limits or bool(((array >= 0) & (array < limits[name])).all()))
            for name, array in self.named_buffers()
        )

    def scores(self, features: torch.Tensor) -> torch.Tensor:
        """Features (B, D) float64 -> scores (B, classes)."""
        at = torch.zeros((len(self.feature), len(features)), dtype=torch.int64, device=features.device)
        for _ in range(int(self.depth)):
            seen = features.T.gather(0, self.feature.gather(1, at))
            goes_left = seen <= self.threshold.gather(1, at)
            at = torch.where(goes_left, self.left.gather(1, at), self.right.gather(1, at))
        found = torch.zeros((len(self.offset), len(features)), dtype=torch.float64, device=features.device)
        found.index_add_(0, self.label, self.value.gather(1, at))
        return found.T + self.offset


def of_arrays(arrays: dict[str, torch.Tensor]) -> Classical:
    """Return the model that these arrays, a `state_dict`, belong to. Raises: InputError where they belong to none."""
    return (Vectors if "support" in arrays else Trees)(**arrays)


def padded(trees: list[dict[str, np.ndarray]], label: list[int], offset: np.ndarray) -> Trees:
    """Return trees of different sizes as one module.

    trees: {feature, threshold, left, right, value}, each (nodes,); of a leaf, left is negative.
    """
    nodes = max(len(tree["feature"]) for tree in trees)
    shape = (len(trees), nodes)
    itself = np.tile(np.arange(nodes), (len(trees), 1))
    arrays = {
        "feature": np.zeros(shape, np.int64), "left": itself, "right": itself.copy(),
        "threshold": np.zeros(shape), "value": np.zeros(shape),
    }  # fmt: skip
    depth = 0
    for number, tree in enumerate(trees):
        inner = np.flatnonzero(np.asarray(tree["left"]) >= 0)
        for name in ("feature", "left", "right", "threshold"):
            arrays[name][number, inner] = np.asarray(tree[name])[inner]
        arrays["value"][number, : len(tree["value"])] = tree["value"]
        depth = max(depth, _depth(arrays["left"][number], arrays["right"][number]))
    ones = {"depth": np.array(depth), "temperature": np.array(1.0)}
    return Trees(**arrays, label=np.array(label, np.int64), offset=np.asarray(offset, np.float64), **ones)


def _depth(left: np.ndarray, right: np.ndarray) -> int:
    """Steps from the root to the deepest leaf of one tree, whose leaves point to themselves."""
    reached, steps = {0}, 0
    while True:
        later = {int(child) for node in reached if left[node] != node for child in (left[node], right[node])}
        if not later:
            return steps
        reached, steps = later, steps + 1
