"""How often 95 % intervals of differences between schemes hold the truth, where the truth is known.

    python benchmarks/interval_coverage.py --out results/benchmarks/interval_coverage.csv

Two schemes that are equally good are given shares of correct samples that differ by chance: by
training seed, by subtype and by motion model, with the spreads of CASES. An interval of 95 % should
hold the difference of zero in 95 % of the trials. Two columns for each case: the intervals of the
tables, and plain resampling of all three levels.
"""

import argparse
from typing import NamedTuple

import numpy as np

from lowalt.files.csv_tables import write_csv
from lowalt.numerics.streams import stream
from lowalt.recognition.intervals import model_weights, strict_difference

COLUMNS = ("case", "seeds", "subtypes", "models", "trials", "held_percent", "plain_held_percent")
SUBTYPES = 20
MODELS = 10


class Case(NamedTuple):
    """Standard deviations by seed, subtype and motion model; whether subtypes are drawn; number of
    seeds.
    """

    seed: float
    subtype: float
    model: float
    whole: bool
    seeds: int = 3


CASES = {
    "seeds": Case(1.0, 0.0, 0.0, True),
    "subtypes": Case(0.0, 1.0, 0.0, True),
    "models of drawn subtypes": Case(0.0, 0.0, 1.0, True),
    "models of known subtypes": Case(0.0, 0.0, 1.0, False),
    "all three": Case(0.3, 1.0, 1.0, True),
    "all three, large spread of seeds": Case(1.0, 1.0, 1.0, True),
    "all three, five seeds": Case(0.3, 1.0, 1.0, True, 5),
}
NAMES = np.repeat(np.arange(SUBTYPES), MODELS).astype(str)


def _schemes(case: Case, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Accuracies (seeds, motion models) of two schemes, drawn with the spreads of a case."""
    shape = (case.seeds, SUBTYPES * MODELS)
    apart = np.repeat(case.subtype * generator.standard_normal(SUBTYPES), MODELS)
    apart += case.model * generator.standard_normal(SUBTYPES * MODELS)
    by_seed = case.seed * generator.standard_normal((2, case.seeds, 1))
    return np.broadcast_to(by_seed[0], shape) + apart / 2, np.broadcast_to(
        by_seed[1], shape
    ) - apart / 2


def _plain(
    one: np.ndarray, other: np.ndarray, case: Case, repeats: int, generator: np.random.Generator
) -> np.ndarray:
    """Bounds of the interval from resampling seeds, subtypes and models with no correction."""
    weights = model_weights(NAMES, case.whole, repeats, generator)
    weights /= weights.sum(1, keepdims=True)
    even = np.full(case.seeds, 1 / case.seeds)
    means = [
        ((weights @ shares.T) * generator.multinomial(case.seeds, even, repeats) / case.seeds).sum(
            1
        )
        for shares in (one, other)
    ]
    return np.quantile(means[0] - means[1], [0.025, 0.975])


def held(
    case: Case, trials: int, repeats: int, generator: np.random.Generator, plain: bool = False
) -> float:
    """Return the share of trials whose interval holds the true difference, zero."""
    count = np.ones(SUBTYPES * MODELS)
    found = 0
    for _ in range(trials):
        one, other = _schemes(case, generator)
        if plain:
            low, high = _plain(one, other, case, repeats, generator)
        else:
            _, low, high = strict_difference(
                one, other, count, NAMES, case.whole, generator, repeats
            )
        found += low <= 0 <= high
    return found / trials


def main() -> None:
    """Simulate all cases and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--trials", type=int, default=2000, help="simulated comparisons a case")
    options.add_argument("--out", required=True, help="table to write (.csv)")
    given = options.parse_args()
    rows = []
    for name, case in CASES.items():
        shares = [
            held(case, given.trials, 400, stream(1, "coverage", name), plain)
            for plain in (False, True)
        ]
        rows.append(
            [
                name,
                case.seeds,
                SUBTYPES,
                MODELS,
                given.trials,
                *(f"{100 * share:.1f}" for share in shares),
            ]
        )
        print(rows[-1], flush=True)
    write_csv(given.out, COLUMNS, rows)


if __name__ == "__main__":
    main()
