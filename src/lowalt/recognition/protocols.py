"""The two protocols: which (group, fold) pairs train, validate and test."""

from lowalt.files.errors import InputError

_SEEN_FOLDS = {
    "train": {("seen", "train"), ("unseen", "train")},
    "validation": {("seen", "val"), ("unseen", "val")},
    "test": {("seen", "test"), ("unseen", "test")},
}
_UNSEEN_FOLDS = {
    "train": {("seen", "train")},
    "validation": {("seen", "val")},
    "test": {("unseen", "train"), ("unseen", "val"), ("unseen", "test")},
    "seen_test": {("seen", "test")},
}
FOLDS = {"seen": _SEEN_FOLDS, "unseen": _UNSEEN_FOLDS}


def folds(protocol: str, part: str) -> set[tuple[str, str]]:
    """Return the (group, fold) pairs of a protocol's part.

    part: "train", "validation", "test" or, of the protocol unseen, "seen_test".
    Raises: InputError for an unknown protocol or part. Source: paper, section V-A.
    """
    try:
        return FOLDS[protocol][part]
    except KeyError:
        raise InputError(
            f"protocol {protocol!r} has no part {part!r}, expected one of {FOLDS}"
        ) from None


def evaluated_folds(protocol: str) -> set[tuple[str, str]]:
    """Return the (group, fold) pairs of all parts of a protocol but its training part.

    Raises: as `folds`.
    """
    return set().union(
        *(folds(protocol, part) for part in FOLDS.get(protocol, ("test",)) if part != "train")
    )
