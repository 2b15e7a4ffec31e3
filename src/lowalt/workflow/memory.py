"""Memory that a job asks of a cluster, from the figures measured on finished runs (results/reference/space.csv)."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lowalt.workflow import space
from lowalt.workflow.run import Run

MARGIN = 1.5
"""Memory asked for, as a multiple of the measured peak: nodes and versions of libraries differ."""
LEAST_MB = 1000
"""Python and its libraries alone, on any node."""


class Memory:
    """Memory of the rules of one run; `table` is the file of measured figures."""

    def __init__(self, run: Run, table: str | Path) -> None:
        self._run = run
        self._figures = space.read(table) if Path(table).is_file() else {}

    def __call__(self, rule: str) -> Callable[..., int]:
        """Return what a rule's `resources: mem_mb=` needs: a function of wildcards and attempt, in MB (1e6 bytes).

        A job that ran out of memory asks for twice as much at its second attempt, three times at its third. A rule
        without figures asks for LEAST_MB, which the profile of a cluster may replace.
        """

        def mem_mb(wildcards: Any, attempt: int) -> int:
            figure = self._figures.get(rule)
            if figure is None:
                return attempt * LEAST_MB
            units = space.units(rule, dict(wildcards.items()), self._run.plan, self._run.config)
            return attempt * max(LEAST_MB, math.ceil(MARGIN * figure.memory(units) / 1e6))

        return mem_mb
