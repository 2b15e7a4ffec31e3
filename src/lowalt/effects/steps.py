"""The error allowed before a converter: its steps leave no bound of the largest error, only of the mean square."""

import math

from lowalt.effects.catalogue import providing
from lowalt.effects.chain import COARSEST, EXACT, Chain
from lowalt.effects.interface import Amplifies, ChoosesCells, Quantises

SHARE = 0.05
"""Share of the tolerance by which interpolation may err before a converter, rms: nothing else errs there."""


def steps_alone(chain: Chain) -> bool:
    """Return whether converters are the only effects without a bound of an error, apart from choices of cells."""
    named = providing((*chain.transmitter, *chain.receiver, *chain.detection), Amplifies)
    sudden = [effect for effect in named if math.isinf(effect.module.amplifies(effect.settings))]
    steps, choices = providing(sudden, Quantises), providing(sudden, ChoosesCells)
    return bool(steps) and len(steps) + len(choices) == len(sudden)


def error_before(chain: Chain, allowed: float) -> float:
    """Return the error of interpolation with which range cells behind a converter err by at most `allowed`, rms.

    allowed: in the signal's units; the result is relative to the sum of peak amplitudes. A component that errs by e
    gets another code with probability e over the step, and then errs by a step: its mean square error is e times the
    step. Subcarriers that err by E leave E / sqrt(M) to a sample, by its two components at most sqrt(2) of that
    together; range cells then have a sample's mean square error, since all transforms keep the 2-norm. The chain must
    have run once, so that its step is known.
    """
    factors = (one.module.amplifies(one.settings) for one in providing((*chain.receiver, *chain.detection), Amplifies))
    stretch = math.prod(factor for factor in factors if math.isfinite(factor))
    # Instants and frequencies are interpolated one after the other.
    strongest = stretch * 2.0 * float(chain.target.strengths.sum(axis=1).max())
    fits = allowed
    if chain.receiving.step > 0:
        fits = min(allowed, allowed**2 * math.sqrt(0.5 * chain.view.network.subcarriers) / chain.receiving.step)
    # Without an echo, any error is small enough.
    return min(max(EXACT, fits / strongest), COARSEST) if strongest > 0 else COARSEST
