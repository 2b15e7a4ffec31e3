"""Two methods of the benchmark's table side by side, for `lowalt compare`."""

from lowalt.extensions.benchmark.baseline_table import words
from lowalt.extensions.benchmark.baselines import compared
from lowalt.extensions.benchmark.benchmark import against


def compared_named(first: str, second: str) -> tuple[dict, str]:
    """Return the paired differences of two methods, track by track, as facts and as text.

    Raises: InputError for an unknown method.
    """
    facts = compared(first, second)
    lines = [f"paired difference in percent: {first} | {second}"]
    for track, one in facts.items():
        difference = against(track, one["difference"], 12)
        lines.append(f"{difference}; {words(one['first'])} | {words(one['second'])}")
    return {"tracks": facts}, "\n".join(lines)
