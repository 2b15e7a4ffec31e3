"""Rotors of one craft turn at slightly different rates, and each rate wanders.

A flight controller keeps attitude by changing the rotors' rates against each other. Rotor p turns
at F_p (1 + s_p + w_p(t)): F_p is the motion model's rate times the rotor's own factor, s_p is drawn
once, w_p is an Ornstein-Uhlenbeck process whose integral is the added phase.
"""

import numpy as np

from lowalt.motion.poses import Perturbation
from lowalt.scene.laws.markov import step_s, steps, walk
from lowalt.targets.cloud import Cloud

SOURCE = (
    "Uhlenbeck & Ornstein, On the theory of the Brownian motion, 1930; exact joint steps of the "
    "process and its integral: Gillespie, Exact numerical simulation of the Ornstein-Uhlenbeck "
    "process and its integral, 1996; magnitudes: flight logs of multirotors, second-hand"
)
DEFAULTS = {"spread": 0.05, "wander": 0.02, "correlation_s": 1.5}
IDLE = [{"spread": 0, "wander": 0}]
JUMPS = True


def perturb(
    settings: dict, cloud: Cloud, row: dict, times_s: np.ndarray, rng: np.random.Generator
) -> Perturbation:
    """Return the turns (rad) added to each rotor at `times_s` (N,) s, equally spaced.

    Nothing is returned for other targets.

    The spread's added turn is zero at time 0; the wander's is zero at the first of the times.
    """
    rotors = cloud.parts_of("rotor")
    if not rotors:
        return Perturbation({})
    spread = settings["spread"] * rng.standard_normal(len(rotors))
    first = rng.standard_normal(len(rotors))
    normal = rng.standard_normal((len(rotors), len(times_s) - 1, 2))
    step = step_s(times_s)
    # In units of the step and of the wander's own size: rate w, which settles at variance one, and
    # its integral.
    decay = step / settings["correlation_s"]
    drift = np.array([[-decay, 0.0], [1.0, 0.0]])
    noise = np.array([np.sqrt(2 * decay), 0.0])
    start = np.stack([first, np.zeros(len(rotors))], axis=1)
    path = walk([steps(drift, noise)] * len(rotors), start, normal)
    seconds = spread[:, None] * times_s + settings["wander"] * step * path[..., 1]
    radps = 2 * np.pi * row["rate_hz"] * cloud.rate_factors[rotors]
    return Perturbation(dict(zip(rotors, radps[:, None] * seconds, strict=True)))
