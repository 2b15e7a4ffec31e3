"""Searches for a scene in which physics left out changes more than the tolerance: at random and by an optimiser.

    PYTHONPATH=tests/support python benchmarks/effects_search.py --out results/benchmarks/effects_search.csv

Every scene is made of numbers in [0, 1]: which effects it names, how strong they are, the target and its place. The
table counts for each effect the scenes that name it, and gives the largest change over the tolerance among them. The
last two rows are of all random scenes and of all that the optimiser (differential evolution) tried.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.optimize import differential_evolution

from every_effect import NAMES, NUMBERS_OF_A_SCENE, case, change
from lowalt.common.csv_tables import short, write_csv

COLUMNS = ("effect", "scenes", "largest_change_over_tolerance")


def at_random(count: int, seed: int) -> list[tuple]:
    """Rows of the table for `count` random scenes: one for each effect, and one for all scenes."""
    found = [case(np.random.default_rng([seed, index]).random(NUMBERS_OF_A_SCENE)) for index in range(count)]
    shares = [change(one) for one in found]
    rows = []
    for name in NAMES:
        mine = [share for one, share in zip(found, shares, strict=True) if name in one.effects]
        rows.append((name, len(mine), short(max(mine, default=None))))
    return [*rows, ("all, at random", len(shares), short(max(shares)))]


def by_optimiser(rounds: int, seed: int) -> tuple:
    """The row of an optimiser that looks for the largest change over the tolerance."""
    shares = []

    def goal(numbers: np.ndarray) -> float:
        """Minus the order of magnitude of a scene's change over its tolerance."""
        shares.append(change(case(numbers)))
        return -np.log10(max(shares[-1], 1e-15))

    differential_evolution(
        goal, [(0.0, 1.0)] * NUMBERS_OF_A_SCENE, maxiter=rounds, popsize=1, rng=seed, polish=False, tol=0
    )
    return "all, by the optimiser", len(shares), short(max(shares))


def main() -> None:
    """Search and write the table; fails where a scene breaks its tolerance."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--scenes", type=int, default=1000, help="random scenes (default: 1000)")
    parser.add_argument("--rounds", type=int, default=9, help="rounds of the optimiser (default: 9)")
    parser.add_argument("--seed", type=int, default=4)
    given = parser.parse_args()
    rows = [*at_random(given.scenes, given.seed), by_optimiser(given.rounds, given.seed)]
    write_csv(given.out, COLUMNS, rows)
    broken = [row for row in rows if row[2] and float(row[2]) > 1]
    if broken:
        raise SystemExit(f"{given.out}: {broken} broke the tolerance")


if __name__ == "__main__":
    main()
