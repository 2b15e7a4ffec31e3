"""What tests make again and again from equal records is made once per process: the values of the
repository's own YAML files, the checks of the forty shipped records, for which their models are
built, and the clouds of data sets.
"""

import functools
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


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


def once_of_repository(parse: Callable[[str, Any], Any]) -> Callable[[str, Any], Any]:
    """As `once`, of a function of (text, path); a text of a file elsewhere is parsed anew."""
    kept = once(parse)

    @functools.wraps(parse)
    def parsed(text: str, path: Any) -> Any:
        """A copy of what was parsed, or of files of a test something new."""
        of_repository = ROOT in Path(path).resolve().parents
        return (kept if of_repository else parse)(text, path)

    return parsed
