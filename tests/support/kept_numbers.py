"""What every function of some rooms returns while scenes are computed, in a few numbers a function.

    make kept-numbers          (keeps tests/data/kept_numbers.csv again)

A function's row tells how often it was called, how many numbers it returned, and two sums over these: of the logarithms
of each array's largest number, and of all numbers relative to it, each with a weight of its own. Where it returns
nothing, the numbers are those that it was given, into which it may have written. A change of any number by more than
rounding moves a sum. Functions whose sums depend on the processor by more than rounding are not kept, and neither are
those that return work space.
"""

import dataclasses
import importlib
import json
import math
import os
import pkgutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import numpy as np

from lowalt.common.csv_tables import read_csv, write_csv

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "tests/data/kept_numbers.csv"
COLUMNS = ("scenes", "function", "calls", "numbers", "sizes", "values", "rounding")
ROOMS = ("echo", "effects")
SMALL = 1e-9
"""Numbers below this share of the largest one of their array count less and less: they may be rounding."""
MOST = 1000
"""Numbers of an array that enter the sums, about."""
ROUNDING, LARGEST_ROUNDING = 1e-9, 1e-5
"""Difference of a sum over the root of the numbers in it: at least this may be rounding, and more than the second is
not kept."""
ROOM = 100.0
"""How much more two processors may differ than the two that were compared."""
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def arrays(value: object, depth: int = 4) -> Iterator[np.ndarray]:
    """All arrays and numbers in a returned value, those of tuples, lists, dictionaries and data classes in order."""
    if isinstance(value, (bool, int, float, complex, np.generic, np.ndarray)):
        array = np.asarray(value)
        if array.dtype.kind in "biufc" and array.size:
            yield array
    elif depth and isinstance(value, dict):
        for inner in value.values():
            yield from arrays(inner, depth - 1)
    elif depth and isinstance(value, (tuple, list)):
        for inner in value:
            yield from arrays(inner, depth - 1)
    elif depth and dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from arrays(getattr(value, field.name, None), depth - 1)


class Sums:
    """The row of one function, as it grows."""

    def __init__(self) -> None:
        self.calls, self.numbers, self.sizes, self.values = 0, 0, 0.0, 0.0

    def add(self, value: object) -> None:
        """Count a call that returned this."""
        self.calls += 1
        for array in arrays(value):
            with np.errstate(invalid="ignore"):
                parts = np.ascontiguousarray(array, np.complex128 if array.dtype.kind == "c" else np.float64)
            parts = np.nan_to_num(parts.reshape(-1).view(np.float64), nan=-0.1234, posinf=1e300, neginf=-1e300)
            largest = float(abs(parts).max())
            # Of a large array every so-many-th number will do: what changes it changes most of it.
            place = np.arange(0, len(parts), 1 + len(parts) // MOST)
            weights = 0.5 + (self.numbers + place + 1) * GOLDEN % 1.0
            parts, self.numbers = parts[place], self.numbers + len(parts)
            if largest > 0.0:
                self.sizes += float(weights[0]) * math.log(largest)
                self.values += float(np.dot(weights, np.arcsinh(parts / largest / SMALL)))


def traced(call: Callable[[], object]) -> dict[str, Sums]:
    """Return the sums of every function of ROOMS that runs during a call, by its module and name."""
    prefixes = {str(ROOT / "src/lowalt" / room) + "/": room for room in ROOMS}
    known: dict[str, str | None] = {}
    found: dict[str, Sums] = {}

    def module(file: str) -> str | None:
        """Dotted name of a file of the rooms, None for any other file."""
        if file not in known:
            inside = any(file.startswith(prefix) for prefix in prefixes)
            name = file.removeprefix(str(ROOT / "src/lowalt") + "/").removesuffix(".py").replace("/", ".")
            known[file] = name if inside else None
        return known[file]

    def note(frame: FrameType, event: str, value: object) -> None:
        """Add what a function returns."""
        if event != "return":
            return
        code = frame.f_code
        name = module(code.co_filename)
        if name is not None and "<" not in code.co_name:
            sys.setprofile(None)
            if value is None:
                # What it was given, since it may have written there.
                value = [frame.f_locals.get(given) for given in code.co_varnames[: code.co_argcount]]
            found.setdefault(f"{name}.{code.co_qualname}", Sums()).add(value)
            sys.setprofile(note)

    sys.setprofile(note)
    try:
        call()
    finally:
        sys.setprofile(None)
    return found


def forget() -> None:
    """Empty all caches of the package's functions: what they keep would not be computed, and so not be seen.

    All modules of the rooms are imported first, so that nothing of this is seen.
    """
    for room in ROOMS:
        package = importlib.import_module(f"lowalt.{room}")
        for found in pkgutil.walk_packages(package.__path__, f"lowalt.{room}."):
            if not found.name.endswith("__main__"):
                importlib.import_module(found.name)
    for name, loaded in list(sys.modules.items()):
        if name.startswith("lowalt."):
            for thing in list(vars(loaded).values()):
                if hasattr(thing, "cache_clear"):
                    thing.cache_clear()


def rows(scenes: dict[str, Callable[[], object]]) -> list[dict[str, str]]:
    """Return a row (keys COLUMNS) for every function that runs in each group of scenes."""
    result = []
    for title, call in scenes.items():
        forget()
        for name, sums in sorted(traced(call).items()):
            values = (title, name, sums.calls, sums.numbers, f"{sums.sizes:.15g}", f"{sums.values:.15g}", "")
            result.append(dict(zip(COLUMNS, map(str, values), strict=True)))
    return result


def read(path: Path = TABLE) -> list[dict[str, str]]:
    """Return the kept rows."""
    return read_csv(path)


def apart(one: dict[str, str], other: dict[str, str]) -> float:
    """How far two rows of a function are apart: the largest difference of a sum over the root of the numbers in it.

    It is infinite where calls or numbers are more or fewer.
    """
    if one["calls"] != other["calls"] or one["numbers"] != other["numbers"]:
        return math.inf
    root = 1.0 + math.sqrt(float(one["numbers"]))
    return max(abs(float(one[key]) - float(other[key])) / root for key in ("sizes", "values"))


def differs(kept: dict[str, str], found: dict[str, str]) -> bool:
    """Whether a function's row tells of other numbers than its kept row, by more than rounding explains."""
    return not apart(kept, found) <= float(kept["rounding"] or ROUNDING)


def by_name(table: list[dict[str, str]]) -> dict[tuple[str, str], dict[str, str]]:
    """Rows by scenes and function."""
    return {(row["scenes"], row["function"]): row for row in table}


def main() -> None:
    """Keep the rows that are the same here and on a processor without wide instructions."""
    from emulation import run
    from kept_scenes import SCENES

    if sys.argv[1:] == ["rows"]:
        json.dump(rows(SCENES), sys.stdout)
        return
    found = []
    for name, filled in (("native", "170"), ("x86-64-v2", "85")):
        # What new arrays hold before they are filled differs too: no function that returns such numbers is kept.
        os.environ["MALLOC_PERTURB_"] = filled
        found.append(by_name(json.loads(run(name, __file__, "rows"))))
    here, there = found
    kept = []
    for name, row in here.items():
        rounding = max(ROUNDING, ROOM * apart(row, there[name])) if name in there else math.inf
        if rounding <= LARGEST_ROUNDING:
            kept.append(row | {"rounding": f"{rounding:.1g}" if rounding > ROUNDING else ""})
    print(f"{len(kept)} of {len(here)} rows are kept; not these: {sorted(here.keys() - by_name(kept).keys())}")
    write_csv(TABLE, COLUMNS, kept)


if __name__ == "__main__":
    main()
