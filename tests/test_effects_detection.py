"""Detection effects: residues, responses and error rates against their closed forms."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from effects_frames import network
from lowalt.common.errors import InputError
from lowalt.effects.catalogue import called
from lowalt.effects.detection import canceller, cell_error

KINDS = [
    {"kind": "mean"},
    {"kind": "pulse", "order": 1},
    {"kind": "pulse", "order": 2},
    {"kind": "pulse", "order": 5},
    {"kind": "exponential", "memory": 0.3},
    {"kind": "exponential", "memory": 0.95},
]


def cancelled(given: dict, cells: np.ndarray) -> np.ndarray:
    """Cells (N, M) after the canceller."""
    return canceller.process({**canceller.DEFAULTS, **given}, cells, None, np.random.default_rng(1))


def chosen(given: dict, symbols: int = 20_000, cells: int = 64, seed: int = 1) -> np.ndarray:
    """Chosen cells of a target that stands in cell 30."""
    plain = np.full(symbols, 30)
    table = np.zeros((symbols, cells))
    return cell_error.choose({**cell_error.DEFAULTS, **given}, plain, table, np.random.default_rng(seed))


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("canceller", {"kind": "none"}),
        ("canceller", {"kind": "pulse", "order": 0}),
        ("cell_error", {"probability": 0}),
        ("cell_error", {"spread_cells": 0}),
    ],
)
def test_strength_zero_is_dropped(name, given):
    assert called({name: given}) == []
    assert [effect.name for effect in called({name: None})] == [name]


# Canceller


@pytest.mark.parametrize("given", KINDS)
def test_what_stands_still_leaves_nothing(given):
    rng = np.random.default_rng(0)
    static = 1e3 * rng.standard_normal(64).view(complex)
    assert not cancelled(given, np.tile(static, (400, 1))).any()


@pytest.mark.parametrize("given", KINDS)
def test_clutter_below_a_target_leaves_only_rounding(given):
    line = np.exp(2j * np.pi * 0.13 * np.arange(400))[:, None] * np.ones(8)
    static = 1e4 * np.random.default_rng(0).standard_normal(16).view(complex)
    apart = cancelled(given, line + static) - cancelled(given, line)
    # Adding clutter rounds every cell to half a unit in its last place; the filter adds these up.
    bound = canceller.amplifies({**canceller.DEFAULTS, **given}) * np.finfo(float).eps * np.linalg.norm(line + static)
    assert np.linalg.norm(apart) < 2 * bound


@pytest.mark.parametrize("given", KINDS[1:])
@pytest.mark.parametrize("turns", [0.003, 0.05, 0.25, 0.5, -0.37])
def test_a_moving_target_keeps_the_closed_form_share(given, turns):
    line = np.exp(2j * np.pi * turns * np.arange(600))[:, None]
    # The start dies away as memory^n: after 500 symbols of 0.95 nothing is left.
    settled = cancelled(given, line)[500:, 0]
    want = canceller.response({**canceller.DEFAULTS, **given}, turns)
    np.testing.assert_allclose(abs(settled), want, rtol=1e-9, atol=1e-12)


def test_pulse_response_is_the_sine_law():
    turns = np.linspace(-0.5, 0.5, 41)
    one = canceller.response({"kind": "pulse", "order": 1}, turns)
    np.testing.assert_allclose(one * math.sqrt(2), 2 * abs(np.sin(np.pi * turns)), atol=1e-14)
    two = canceller.response({"kind": "pulse", "order": 2}, turns)
    np.testing.assert_allclose(two * math.sqrt(6), 4 * np.sin(np.pi * turns) ** 2, atol=1e-14)


@settings(max_examples=30, deadline=None)
@given(st.floats(-0.5, 0.5))
def test_the_mean_leaves_a_moving_target_all_but_its_dirichlet_share(turns):
    line = np.exp(2j * np.pi * turns * np.arange(400))[:, None]
    kept = np.mean(abs(cancelled({"kind": "mean"}, line)) ** 2)
    # The mean of the line over the look, sin(pi N x) / (N sin(pi x)).
    below = 400 * math.sin(math.pi * turns)
    share = math.sin(math.pi * 400 * turns) / below if abs(turns) > 1e-9 else 1.0
    assert kept == pytest.approx(1 - share**2, abs=1e-9)


@pytest.mark.parametrize("given", KINDS)
def test_white_noise_keeps_its_power(given):
    noise = np.random.default_rng(3).standard_normal((4000, 128)).view(complex)
    settled = cancelled(given, noise)[200:]
    assert np.mean(abs(settled) ** 2) == pytest.approx(np.mean(abs(noise) ** 2), rel=0.02)


@pytest.mark.parametrize("given", KINDS)
def test_errors_grow_by_no_more_than_amplifies(given):
    # The worst of errors that are no larger than one in any symbol.
    most = abs(cancelled(given, np.eye(120))).sum(axis=1).max()
    bound = canceller.amplifies({**canceller.DEFAULTS, **given})
    assert 0.95 * bound <= most <= bound * (1 + 1e-12)


def test_a_fading_memory_tends_to_the_identity_on_what_moves():
    # memory -> 0 forgets at once and leaves the first difference's zero only at 0 Hz; memory -> 1 keeps all that moves.
    turns = np.array([0.02, 0.1, 0.5])
    wide = canceller.response({"kind": "exponential", "memory": 1 - 1e-7}, turns)
    np.testing.assert_allclose(wide, 1, atol=1e-6)


# Wrong cells


def test_jitter_is_uniform_without_zero():
    off = chosen({"probability": 0.25, "spread_cells": 3}) - 30
    values, counts = np.unique(off, return_counts=True)
    assert values.tolist() == [-3, -2, -1, 0, 1, 2, 3]
    expected = np.array([1, 1, 1, 18, 1, 1, 1]) / 24 * 20_000
    assert np.sum((counts - expected) ** 2 / expected) < 22.5  # chi-square, 6 degrees, 0.1 %
    errors = off != 0
    assert abs(np.corrcoef(errors[1:], errors[:-1])[0, 1]) < 5 / math.sqrt(20_000)


def test_fixed_is_always_the_same_number():
    off = chosen({"probability": 0.4, "spread_cells": -5, "mode": "fixed"}) - 30
    assert set(off.tolist()) == {0, -5}
    assert np.mean(off != 0) == pytest.approx(0.4, abs=5 * math.sqrt(0.24 / 20_000))
    assert (chosen({"probability": 1, "spread_cells": 4, "mode": "fixed"}) == 34).all()


def test_a_held_error_is_all_or_none():
    looks = np.array([chosen({"probability": 0.3, "hold": "look"}, 50, seed=seed) for seed in range(1500)])
    assert (looks == looks[:, :1]).all()
    assert np.mean(looks[:, 0] != 30) == pytest.approx(0.3, abs=5 * math.sqrt(0.21 / 1500))
    assert set((looks[:, 0] - 30).tolist()) == {-2, -1, 0, 1, 2}


def test_cells_wrap_around_as_ranges_do():
    table = np.zeros((2, 8))
    moved = cell_error.choose(
        {**cell_error.DEFAULTS, "probability": 1, "spread_cells": 3, "mode": "fixed"},
        np.array([6, 1]),
        table,
        np.random.default_rng(1),
    )
    assert moved.tolist() == [1, 4]
    assert moved.dtype == np.int64


@settings(max_examples=20, deadline=None)
@given(st.floats(0, 1), st.integers(1, 9), st.sampled_from(["jitter", "fixed"]), st.sampled_from(["symbol", "look"]))
def test_draws_are_as_many_whatever_the_values(probability, spread, mode, hold):
    given = {"probability": probability, "spread_cells": spread, "mode": mode, "hold": hold}
    after, plain = np.random.default_rng(2), np.random.default_rng(2)
    cell_error.choose(given, np.full(30, 5), np.zeros((30, 32)), after)
    plain.random(60)
    assert after.bit_generator.state == plain.bit_generator.state


def test_rarer_errors_are_a_part_of_the_frequent_ones():
    often, rare = (chosen({"probability": p}, 2000) for p in (0.3, 0.01))
    assert (often[rare != 30] == rare[rare != 30]).all()
    assert 0 < np.sum(rare != 30) < 60


def test_a_spread_around_all_cells_is_refused():
    checked = SimpleNamespace(network=network(4, 8), effects={})
    with pytest.raises(InputError, match="spread_cells: 4, expected less than half of 8"):
        cell_error.check({**cell_error.DEFAULTS, "spread_cells": 4}, checked)
    cell_error.check({**cell_error.DEFAULTS, "spread_cells": 3}, checked)
