"""Noise: the SNR that was set is the SNR that is there, and every stream is its own."""

import json
import math

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.motion import write_table
from lowalt.noise import add_noise
from lowalt.noise.__main__ import load_echoes, load_powers, main
from lowalt.noise.awgn import noisy_signals
from lowalt.numerics import normals
from lowalt.numerics.draws import Draws
from moving_clouds import row
from options import words


def measured_snr_db(snr_db: float, scale: float = 1.0) -> float:
    """SNR read back from a long tone of changing strength with noise."""
    signal = scale * np.exp(1j * np.arange(200_000)) * np.linspace(0.5, 2.0, 200_000)
    noise = add_noise(signal, snr_db, np.random.default_rng(3)) - signal
    return 10 * math.log10(np.mean(np.abs(signal) ** 2) / np.mean(np.abs(noise) ** 2))


@pytest.mark.parametrize("snr_db", [-60.0, 3.0, 100.0])
def test_set_snr_is_read_back(snr_db):
    # 4e5 Gaussian draws: the power's relative standard error is 0.22 %, 0.01 dB.
    assert measured_snr_db(snr_db) == pytest.approx(snr_db, abs=0.05)


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1e150])
def test_scale_does_not_matter(scale):
    signal = scale * np.exp(1j * np.arange(100))
    plain = add_noise(np.exp(1j * np.arange(100)), 3.0, np.random.default_rng(1))
    np.testing.assert_allclose(
        add_noise(signal, 3.0, np.random.default_rng(1)) / scale, plain, rtol=1e-12
    )


def test_noise_is_circular_and_white():
    signal = np.ones(100_000, complex)
    noise = add_noise(signal, 0.0, np.random.default_rng(5)) - signal
    assert abs(np.mean(noise**2)) < 0.02
    assert abs(np.mean(noise[1:] * noise[:-1].conj())) < 0.02
    assert np.var(noise.real) == pytest.approx(0.5, rel=0.02)


def test_infinite_snr_draws_nothing_and_changes_nothing():
    signal = np.exp(1j * np.arange(50))
    rng = np.random.default_rng(1)
    before = rng.bit_generator.state
    assert np.array_equal(add_noise(signal, math.inf, rng), signal)
    assert rng.bit_generator.state == before


@pytest.mark.parametrize(
    ("signal", "snr_db"),
    [([], 3.0), ([1, np.nan], 3.0), ([1, np.inf], 3.0), ([1.0], math.nan), ([1.0], -math.inf)],
)
def test_bad_input_is_refused(signal, snr_db):
    with pytest.raises(InputError, match="noise:"):
        add_noise(np.array(signal), snr_db, np.random.default_rng(1))


def test_a_power_that_is_given_stands_for_the_signal_s_own():
    signal = 3 * np.exp(1j * np.arange(50))
    given = add_noise(np.zeros(50), 3.0, np.random.default_rng(1), 9.0)
    np.testing.assert_allclose(
        given, add_noise(signal, 3.0, np.random.default_rng(1)) - signal, atol=1e-14
    )
    assert np.array_equal(add_noise(signal, 3.0, np.random.default_rng(1), 0.0), signal)
    for power in (-1.0, math.inf, math.nan):
        with pytest.raises(InputError, match="noise: power"):
            add_noise(signal, 3.0, np.random.default_rng(1), power)


def test_each_echo_has_noise_of_its_own_power_as_the_canceller_leaves_it():
    rows = [{"subtype": "crow", "model": 4}, {"subtype": "owl", "model": 9}]
    echoes = np.exp(1j * np.arange(3 * 2 * 40)).reshape(3, 2, 40)
    powers = np.arange(1.0, 7.0).reshape(3, 2)
    plain = noisy_signals(echoes, rows, ["A", "B", "C"], [3.0, math.inf], 1, powers)
    unit = noisy_signals(0 * echoes, rows, ["A", "B", "C"], [3.0], 1, np.ones((3, 2)))[:, 0]
    expected = echoes.swapaxes(0, 1) + np.sqrt(powers.T)[..., None] * unit
    np.testing.assert_allclose(plain[:, 0], expected, atol=1e-6)
    turned = noisy_signals(
        echoes, rows, ["A", "B", "C"], [3.0, math.inf], 1, powers, lambda noise: -2 * noise
    )
    np.testing.assert_allclose(
        turned[:, 0] - plain[:, 0], -3 * (plain[:, 0] - plain[:, 1]), atol=2e-5
    )
    assert np.array_equal(turned[:, 1], plain[:, 1])
    # Echoes that hold the noise of each SNR are only put in order.
    held = np.arange(3 * 2 * 4 * 5).reshape(3, 2, 4, 5)
    assert (
        noisy_signals(held, rows, ["A", "B", "C"], [1, 2, 3, 4], 1)[1, 2, 0] == held[0, 1, 2]
    ).all()


def test_noise_without_a_generator_is_refused():
    with pytest.raises(InputError, match=r"no generator for an SNR of 3 dB"):
        add_noise(np.ones(4), 3, None)


def test_streams_do_not_depend_on_what_else_is_there():
    rows = [{"subtype": "crow", "model": 4}, {"subtype": "owl", "model": 9}]
    echoes = np.exp(1j * np.arange(3 * 2 * 40)).reshape(3, 2, 40).astype(np.complex64)
    full = noisy_signals(echoes, rows, ["A", "B", "C"], [3.0, 8.0, math.inf], seed=1)
    some = noisy_signals(echoes[[2]][:, [1]], rows[1:], ["C"], [8.0], seed=1)
    assert np.array_equal(full[1, 1, 2], some[0, 0, 0])
    assert np.array_equal(full[:, 2].transpose(1, 0, 2), echoes)
    assert not np.array_equal(full[0, 0], full[0, 1])


def test_noise_of_models_snrs_and_stations_is_independent():
    rows = [{"subtype": "crow", "model": model} for model in range(2)]
    noise = noisy_signals(
        np.zeros((2, 2, 4000)), rows, ["A", "B"], [3.0, 8.0], seed=1, powers=np.ones((2, 2))
    )
    draws = noise.reshape(8, 4000) / np.linalg.norm(noise.reshape(8, 4000), axis=1, keepdims=True)
    # The correlation of 4000 independent pairs is 1 / sqrt(4000) = 0.016 rms.
    assert abs(draws @ draws.conj().T - np.eye(8)).max() < 0.08


def test_many_normals_drawn_at_once_are_those_drawn_few_at_a_time():
    at_once, by_parts = (Draws(np.random.PCG64(5)) for _ in range(2))
    parts = [by_parts.standard_normal((500, 2)) for _ in range(9)] + [by_parts.standard_normal(1)]
    assert np.array_equal(
        at_once.standard_normal(9001), np.concatenate([part.ravel() for part in parts])
    )


@pytest.mark.parametrize("count", [1, 2, 399, 1001])
def test_the_compiled_normals_are_those_of_the_draws(count):
    plain, raw = (Draws(np.random.PCG64(count)) for _ in range(2))
    expected = 0.3 * plain.standard_normal(2 * count)
    found = normals.circular(raw.words(2 * count), 0.3)
    assert np.array_equal(found, expected.reshape(-1, 2).T)


def test_an_echo_file_that_was_cut_is_named(tmp_path):
    path = tmp_path / "A.npy"
    np.save(path, np.ones((2, 40), complex))
    assert load_echoes([str(path)], ["A"], 2)[0].shape == (2, 40)
    for size in (100, 300):
        with path.open("r+b") as file:
            file.truncate(size)
        for load in (load_echoes, load_powers):
            with pytest.raises(InputError, match=r"A\.npy: not a whole (echo|power) file"):
                load([str(path)], ["A"], 2)
        np.save(path, np.ones((2, 40), complex))


def test_the_command_adds_noise_at_every_snr_and_says_how_many_samples(tmp_path, capsys):
    write_table(tmp_path / "m.csv", [row(model=0), row(model=1), row(model=2)])
    echo = np.ones((3, 40), np.complex64)
    np.save(tmp_path / "A.npy", echo)
    settings = json.dumps({"seed": 1, "stations": ["A"], "snr_db": [3, "inf"]})
    table, heard, out = (tmp_path / name for name in ("m.csv", "A.npy", "noisy.npy"))
    main(words(settings=settings, motion=table, echoes=heard, out=out))
    noisy = np.load(tmp_path / "noisy.npy")
    assert (
        noisy.shape == (3, 2, 1, 40)
        and (noisy[:, 1, 0] == echo).all()
        and (noisy[:, 0, 0] != echo).all()
    )
    assert capsys.readouterr().err.strip().endswith("noisy.npy: 6 samples")
