"""Laws that hold for all inputs, tried on random ones: how results follow a change of the input,
stage by stage.
"""

import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy import stats

from lowalt.config.splits import FOLDS, fold
from lowalt.noise.awgn import noisy_signals
from lowalt.recognition import tables
from lowalt.recognition.evaluated import Evaluated
from lowalt.recognition.intervals import bootstrap, model_shares
from lowalt.spectra import trp, vrp, vt
from made_predictions import run_files

CARRIER = 4.9e9
INTERVAL = 1 / 3200
SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def complex_noise(seed, *shape):
    """Circular Gaussian numbers of power one."""
    parts = np.random.default_rng(seed).standard_normal((2, *shape)) / math.sqrt(2)
    return parts[0] + 1j * parts[1]


@FEW
@given(
    seed=SEEDS,
    snrs=st.lists(st.floats(-30, 40), min_size=1, max_size=3, unique=True),
    levels=st.lists(st.floats(1e-9, 1e3), min_size=1, max_size=3),
)
def test_noise_has_the_power_of_its_snr_at_every_station_whatever_the_levels_of_the_others(
    seed, snrs, levels
):
    symbols = 4000
    stations = list("DEFG")[: len(levels)]
    echo = np.array(levels)[:, None, None] * np.exp(1j * np.arange(symbols))
    rows = [{"subtype": "Crow", "model": 3}]
    found = noisy_signals(echo, rows, stations, snrs, seed)[0]
    for level, snr_db in enumerate(snrs):
        for place, amplitude in enumerate(levels):
            power = np.mean(np.abs(found[level, place] - echo[place, 0]) ** 2)
            # The mean of 4000 exponential powers errs by 1.6 %; complex64 rounds 1e-14 of the
            # signal's power.
            assert power == pytest.approx(amplitude**2 * 10 ** (-snr_db / 10), rel=0.12)
    # A station's noise is its own: with the others left out, or in another order, it is the same to
    # the bit.
    alone = noisy_signals(echo[:1], rows, stations[:1], snrs, seed)[0]
    assert (alone[:, 0] == found[:, 0]).all()
    turned = noisy_signals(echo[::-1], rows, stations[::-1], snrs[::-1], seed)[0]
    assert (turned[::-1, ::-1] == found).all()


@FEW
@given(seed=SEEDS, delay=st.integers(1, 60))
def test_a_later_start_moves_every_spectrum_and_changes_no_value(seed, delay):
    signal = complex_noise(seed, 400)
    for image in (vrp, trp, lambda cut: vt(cut, CARRIER, INTERVAL)):
        whole = image(signal)
        late = image(signal[delay:])
        expected = whole[:, delay : delay + late.shape[1]]
        np.testing.assert_allclose(late, expected, rtol=1e-9, atol=1e-9 * np.abs(whole).max())


@FEW
@given(seed=SEEDS, scale=st.floats(1e-6, 1e6), phase=st.floats(0, 2 * math.pi))
def test_a_factor_scales_magnitudes_by_its_size_and_velocities_by_its_square(seed, scale, phase):
    signal = complex_noise(seed, 300)
    turned = scale * np.exp(1j * phase) * signal
    np.testing.assert_allclose(vrp(turned), scale * vrp(signal), rtol=1e-9)
    np.testing.assert_allclose(trp(turned), scale * trp(signal), rtol=1e-9)
    plain = vt(signal, CARRIER, INTERVAL)
    bound = 1e-9 * scale**2 * np.abs(plain).max()
    np.testing.assert_allclose(vt(turned, CARRIER, INTERVAL), scale**2 * plain, atol=bound)


@FEW
@given(seed=SEEDS, image=st.sampled_from([vrp, trp]))
def test_time_reversed_shows_windows_backwards_with_frequencies_of_the_other_sign(seed, image):
    """|FFT(x reversed)|(f) = |FFT(x)|(-f); row n/2 is frequency zero and row 0 is its own mirror
    image.
    """
    signal = complex_noise(seed, 333)
    # There is one window fewer than fit, so that of the last symbols is added by a symbol more.
    forward = image(np.append(signal, 0))
    back = image(np.append(signal[::-1], 0))
    mirrored = np.roll(forward[::-1], 1, axis=0)[:, ::-1]
    np.testing.assert_allclose(back, mirrored, rtol=1e-8, atol=1e-10 * forward.max())
    # Conjugation mirrors frequencies and leaves time.
    conjugate = np.roll(image(np.append(signal.conj(), 0))[::-1], 1, axis=0)
    np.testing.assert_allclose(conjugate, forward, rtol=1e-8, atol=1e-10 * forward.max())


@FEW
@given(
    seed=st.integers(0, 10**9),
    models=st.integers(1, 200),
    more=st.integers(1, 100),
    shares=st.tuples(st.integers(1, 9), st.integers(0, 4), st.integers(0, 4)),
    by=st.sampled_from(["motion", "sample"]),
)
def test_models_that_are_added_move_no_fold_and_full_blocks_have_their_shares(
    seed, models, more, shares, by
):
    split = {"by": by, **dict(zip(FOLDS, shares, strict=True))}
    snrs = (3.0, 8.0)
    before = {
        (model, snr): fold(split, seed, "Crow", model, snr)
        for model in range(models)
        for snr in snrs
    }
    # Asked again from the last model to the first, among models and another subtype that are new.
    after = {
        (model, snr): (fold(split, seed, "Owl", model, snr), fold(split, seed, "Crow", model, snr))[
            1
        ]
        for model in reversed(range(models + more))
        for snr in reversed(snrs)
    }
    assert {sample: after[sample] for sample in before} == before
    for snr in snrs:
        for start in range(0, models - sum(shares) + 1, sum(shares)):
            block = [before[model, snr] for model in range(start, start + sum(shares))]
            assert tuple(block.count(name) for name in FOLDS) == shares


@settings(max_examples=4, deadline=None)
@given(seed=SEEDS)
def test_tables_do_not_depend_on_the_order_of_predictions_or_of_runs(seed):
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cases = [("A:VT", 0), ("A:VT", 1), ("ABC:VRP+TRP+VT", 0)]
        paths = [
            run_files(folder, "seen", scheme, 0.8, seed, models=20)[0] for scheme, seed in cases
        ]
        tables.write(
            [Evaluated(path) for path in paths],
            ["A:VT", "ABC:VRP+TRP+VT"],
            {},
            folder / "before",
            1,
        )
        for path in paths:
            head, *lines = path.read_text().splitlines()
            path.write_text("\n".join([head, *rng.permutation(lines)]) + "\n")
        mixed = [Evaluated(paths[number]) for number in rng.permutation(len(paths))]
        tables.write(mixed, ["A:VT", "ABC:VRP+TRP+VT"], {}, folder / "after", 1)
        written = sorted(path.name for path in (folder / "before").iterdir())
        assert "accuracy.csv" in written and len(written) > 6
        for table in written:
            assert (folder / "after" / table).read_bytes() == (
                folder / "before" / table
            ).read_bytes(), table


@settings(max_examples=6, deadline=None)
@given(seed=SEEDS, models=st.integers(30, 80), snrs=st.integers(1, 4))
def test_an_interval_is_as_wide_as_scipy_s_bootstrap_of_motion_models(seed, models, snrs):
    rng = np.random.default_rng(seed)
    motion = np.repeat(np.arange(models), snrs)
    values = np.repeat(rng.random(models), snrs) > rng.random(models * snrs)
    ours = bootstrap(motion, values.astype(float), np.random.default_rng(seed))
    _, _, (shares,) = model_shares(motion, [values])
    theirs = stats.bootstrap(
        (shares,), np.mean, n_resamples=4000, method="percentile", rng=seed
    ).confidence_interval
    assert ours.value == pytest.approx(shares.mean())
    # Ends of 4000 draws err by a few percent of the width.
    width = theirs.high - theirs.low
    assert [ours.low, ours.high] == pytest.approx([theirs.low, theirs.high], abs=0.1 * width)


@settings(max_examples=5, deadline=None)
@given(
    seed=st.integers(0, 1000),
    order=st.permutations(range(3)),
    fusion=st.sampled_from(["attention", "mean"]),
)
def test_the_network_answers_the_same_for_stations_in_another_order(seed, order, fusion):
    torch = pytest.importorskip("torch")
    from test_recognition import images, small_recogniser

    model = _kept(small_recogniser, fusion)
    index = images(2, 6, seed)
    turned = index.unflatten(1, (3, 2))[:, list(order)].flatten(1, 2)
    with torch.inference_mode():
        torch.testing.assert_close(model(turned), model(index), atol=2e-5, rtol=1e-4)
        # Spectra are no such set: their embedding tells one from the other.
        swapped = index.unflatten(1, (3, 2)).flip(2).flatten(1, 2)
        assert fusion == "mean" or not torch.allclose(
            model(swapped), model(index), atol=2e-5, rtol=1e-4
        )


_MODELS: dict = {}


def _kept(made, fusion):
    """One network for all examples."""
    if fusion not in _MODELS:
        _MODELS[fusion] = made("ABC", "VRP+VT", fusion)
    return _MODELS[fusion]
