"""What tests make again and again from equal records is made once per process: the checks of the
forty shipped records, for which their models are built, and the clouds of data sets.
"""

import functools
import pickle
from collections.abc import Callable
from typing import Any


def once(make: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that calls `make` once for equal arguments; each call has a copy of its own.

    An error is not kept, and changed code is not noticed: tests of models call them directly.
    """

    @functools.lru_cache(maxsize=1000)
    def kept(given: bytes) -> bytes:
        """What `make` returns for pickled arguments, pickled."""
        return pickle.dumps(make(*pickle.loads(given)))

    @functools.wraps(make)
    def made(*given: Any) -> Any:
        """A copy of what was made."""
        return pickle.loads(kept(pickle.dumps(given)))

    return made


def once_without_files(make: Callable[..., Any]) -> Callable[..., Any]:
    """As `once`, of a function of (record, inputs, seed); what a record makes from files is made
    anew, because files change.
    """
    kept = once(make)

    @functools.wraps(make)
    def made(record: dict, *sources: Any) -> Any:
        """A copy of what was made, or of files something new."""
        of_files = record["source"] in ("mesh", "mocap")
        return (make if of_files else kept)(record, *sources)

    return made
