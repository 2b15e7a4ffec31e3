"""Search by an optimiser for noise in all cells, or a recording, where what is left out changes too much."""

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from lowalt.effects.catalogue import BY_NEED
from test_effects_bounds import decoded, excess
from test_effects_need import recording_of


def share(place: np.ndarray, recorded: bool) -> float:
    """Change by what was left out over the tolerance, of a scene from thirteen numbers in [0, 1]."""
    radio, cloud, row = decoded(place[:11])
    if recorded:
        cloud = recording_of(np.random.default_rng(int(1e6 * place[6])), cloud)
        row = row | {"start_s": place[8], "playback": 1.0}
    effects = {name: {} for name in BY_NEED} | {"cell_noise": {"snr_db": 60.0 * place[11] - 10.0}}
    return excess(radio, cloud, row, effects, 10 ** (-4.0 + 3.5 * place[12]))[0]


@pytest.mark.slow
@pytest.mark.parametrize("recorded", [False, True])
def test_an_optimiser_finds_no_scene_whose_tolerance_is_broken(recorded):
    found = differential_evolution(
        lambda place: -np.log10(max(share(place, recorded), 1e-15)), [(0.0, 1.0)] * 13, maxiter=10, popsize=3,
        seed=1, polish=False, tol=0,
    )  # fmt: skip
    most = share(found.x, recorded)
    print(f"recorded {recorded}: {found.nfev} scenes, largest change {most:.3f} of the tolerance")
    assert 1e-6 < most <= 1
