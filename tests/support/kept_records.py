"""Records of targets that are merged and checked once per process: every data set of a test reads
the forty shipped ones, and their check builds forty models.
"""

import functools
import pickle
from collections.abc import Callable


def once(merge: Callable[..., dict]) -> Callable[..., dict]:
    """Return `merge`, which runs once for equal arguments; each call has a copy of its own.

    A refusal is not kept, and changed code is not noticed: a test that plants a fault in a model
    calls the model itself.
    """

    @functools.lru_cache(maxsize=1000)
    def kept(given: bytes) -> bytes:
        return pickle.dumps(merge(*pickle.loads(given)))

    def merged(row: dict, record: dict, where: str) -> dict:
        return pickle.loads(kept(pickle.dumps((row, record, where))))

    return merged
