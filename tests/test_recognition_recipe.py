"""The recipe: the range of every setting with its two ends, the moving average, and fixed randomness."""

import math

import numpy as np
import pytest
import torch

from lowalt.files.errors import InputError
from lowalt.recognition import recipe
from trainings import TRAINING

WHOLE = {"steps": 1, "batch": 1, "snrs_per_model": 0, "validate_every": 1, "patience": 0, "threads": 1, "workers": 0,
         "accumulate": 1}  # fmt: skip
SHARES = ("warmup", "label_smoothing", "ema")
REAL = (*SHARES, "rate", "backbone_rate", "weight_decay", "clip", "alone", "checkpoint_s")


@pytest.mark.parametrize(("key", "least"), WHOLE.items())
def test_whole_numbers_are_taken_from_their_least_value_on(key, least):
    for value in (least, 8):
        assert recipe.check({**TRAINING, "batch": 8, key: value})[key] == value
    for wrong in (least - 1, 2.0, True, "2"):
        with pytest.raises(InputError, match=f"training: {key} is {wrong!r}, expected a whole number >= {least}"):
            recipe.check({**TRAINING, key: wrong})


@pytest.mark.parametrize("key", REAL)
def test_real_numbers_are_taken_from_nought_to_their_largest_value(key):
    for value in (0, 1, 1.0, *(() if key in SHARES else (1e12,))):
        assert recipe.check({**TRAINING, key: value})[key] == value
    for wrong in (-1e-9, math.nan, False, "1", *((1.0001,) if key in SHARES else ())):
        with pytest.raises(InputError, match=f"training: {key} is {wrong!r}, expected a number in 0.."):
            recipe.check({**TRAINING, key: wrong})


def test_settings_that_may_be_left_out_change_nothing_then():
    found = recipe.check(TRAINING)
    assert {key: value for key, value in found.items() if key not in TRAINING} == {
        "accumulate": 1, "activation_checkpointing": False}  # fmt: skip
    assert recipe.check({**TRAINING, "batch": 3, "accumulate": 3})["accumulate"] == 3
    with pytest.raises(InputError, match="accumulate is 4, expected at most batch, 3"):
        recipe.check({**TRAINING, "batch": 3, "accumulate": 4})


@pytest.mark.parametrize("decay", [0.0, 0.6, 0.99, 1.0])
def test_the_moving_average_weighs_the_weights_of_k_steps_ago_by_the_decay_to_the_k(decay):
    weights = [3.0, -1.0, 4.0, 1.5, 9.0]
    average = 77.0
    for step, weight in enumerate(weights, start=1):
        kept = recipe.averaging(decay, step)
        average = kept * average + (1 - kept) * weight
        ages = [decay**age for age in range(step)][::-1]
        assert average == pytest.approx(np.average(weights[:step], weights=ages))


def test_seed_names_and_threads_fix_what_torch_draws():
    drawn = []
    for seed, keys in ((1, ("a",)), (1, ("a",)), (2, ("a",)), (1, ("b",))):
        recipe.seeded(seed, keys, 1)
        drawn.append(torch.rand(3).tolist())
    assert drawn[0] == drawn[1] and drawn[2] != drawn[0] != drawn[3]
    assert torch.get_num_threads() == 1 and torch.are_deterministic_algorithms_enabled()
    assert not torch.utils.deterministic.fill_uninitialized_memory
    state = recipe.random_state(torch.device("cpu"))
    following = torch.rand(2)
    recipe.set_random_state(torch.device("cpu"), state)
    assert torch.equal(torch.rand(2), following)
    with pytest.raises(InputError, match=r"random states of \['cpu', 'cuda'\], but this training runs on cpu"):
        recipe.set_random_state(torch.device("cpu"), state | {"cuda": state["cpu"]})
