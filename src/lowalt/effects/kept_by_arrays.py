"""Values that depend on arrays of a target alone, made once as long as these arrays live."""

import weakref
from collections.abc import Callable, Hashable, Sequence
from typing import Any

import numpy as np


class KeptByArrays:
    """What was made of arrays, by the identity of each; a value goes when one of its arrays does."""

    def __init__(self) -> None:
        """Keep nothing yet."""
        self._values: dict[tuple, tuple[list[weakref.ref], Any]] = {}

    def of(self, arrays: Sequence[np.ndarray], make: Callable[[], Any], *more: Hashable) -> Any:
        """Return what `make` returns, made at the first call with these arrays, of any shapes, and these further keys.

        The arrays must not change as long as they live.
        """
        key = (*map(id, arrays), *more)
        held, found = self._values.get(key, ([], None))
        if not held or any(reference() is not array for reference, array in zip(held, arrays, strict=True)):
            found = make()
            references = [weakref.ref(array, lambda _: self._values.pop(key, None)) for array in arrays]
            self._values[key] = references, found
        return found
