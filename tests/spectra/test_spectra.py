"""Spectra against the definitions written out in loops, and the laws and physics that they keep."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import reference_spectra as reference
from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.files.errors import InputError
from lowalt.spectra import (
    NAMES,
    Fourier,
    Spectra,
    Transfer,
    magnitudes,
    spectrum,
    trp,
    vrp,
    vt,
    windows,
    zero_index,
)
from lowalt.spectra.sliding import fourier_magnitudes, transfer, turns
from pictures import SPECTRA
from tables import rows

INTERVAL = 2.5e-3
CARRIER = 4.93192e9


def noise(*shape, seed=0):
    pair = np.random.default_rng(seed).standard_normal((2, *shape))
    return pair[0] + 1j * pair[1]


def assert_close(found, expected):
    """Agreement to 1e-10 of the largest value."""
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize(
    ("symbols", "window", "hop", "points"), [(40, 16, 1, 16), (41, 8, 3, 32), (20, 2, 4, 2)]
)
def test_magnitudes_are_the_definition(symbols, window, hop, points):
    signal = noise(symbols)
    assert_close(
        magnitudes(signal, Fourier(window, hop, points)),
        reference.stft(signal, window, hop, points),
    )


def test_published_shapes_and_definition_at_published_settings():
    signal = noise(400, seed=1)
    assert vrp(signal).shape == (256, 144)
    assert trp(signal).shape == (1024, 392)
    assert vt(signal, CARRIER, INTERVAL).shape == (123, 392)
    # Four windows of the long transform and thirteen of the short one keep the loops short.
    assert_close(vrp(signal[:260]), reference.stft(signal[:260], 256, 1, 256))
    assert_close(trp(signal[:21]), reference.stft(signal[:21], 8, 1, 1024))


@pytest.mark.parametrize(("window", "hop"), [(8, 1), (5, 2)])
def test_velocity_transfer_is_the_definition(window, hop):
    signal = noise(40, seed=2)
    setting = Spectra(vt=Transfer(window, hop, -6.1, 6.1, 0.1))
    speeds = [-6.1 + 0.1 * step for step in range(123)]
    expected = reference.velocity_transfer(signal, CARRIER, INTERVAL, window, hop, speeds)
    assert_close(vt(signal, CARRIER, INTERVAL, setting), expected)


def test_batches_are_single_signals():
    signals = noise(2, 3, 300, seed=3)
    for function in (vrp, trp, lambda s: vt(s, CARRIER, INTERVAL)):
        whole = function(signals)
        assert whole.shape[:2] == (2, 3)
        np.testing.assert_array_equal(whole[1, 2], function(signals[1, 2]))


@pytest.mark.parametrize(("window", "points"), [(256, 256), (8, 1024), (2, 8), (4, 64), (16, 16)])
def test_sliding_transform_is_the_definition(window, points):
    signal = noise(400, seed=4).astype(np.complex64)
    expected = np.fft.ifftshift(magnitudes(signal, Fourier(window, 1, points)), axes=0)
    found = np.empty(expected.shape, np.float32)
    parts = np.ascontiguousarray(signal.real), np.ascontiguousarray(signal.imag)
    fourier_magnitudes(*parts, window, points, *turns(points, np.float32), found)
    assert np.abs(found - expected).max() <= 2e-6 * expected.max()


@pytest.mark.parametrize("window", [1, 5, 8])
def test_sliding_transfer_is_the_definition(window):
    signal = noise(400, seed=5).astype(np.complex64)
    setting = Spectra(vt=Transfer(window, 1, -6.1, 6.1, 0.1))
    expected = vt(signal, CARRIER, INTERVAL, setting)
    found = np.empty(expected.shape, np.float32)
    parts = np.ascontiguousarray(signal.real), np.ascontiguousarray(signal.imag)
    transfer(*parts, window, *spectrum("vt").tables(setting["vt"], CARRIER, INTERVAL), found)
    assert np.abs(found - expected).max() <= 5e-6 * np.abs(expected).max()


@settings(max_examples=25, deadline=None)
@given(st.integers(-128, 127), st.floats(0.1, 10), st.floats(0, 6.3))
def test_a_tone_on_a_bin_stands_in_one_row(row, amplitude, phase):
    tone = amplitude * np.exp(1j * (2 * np.pi * row * np.arange(300) / 256 + phase))
    spectrum = vrp(tone)
    assert (spectrum.argmax(axis=0) == row + 128).all()
    np.testing.assert_allclose(spectrum.max(axis=0), 256 * amplitude, rtol=1e-12)
    # Parseval: a window's energy is the mean of its squared spectrum.
    np.testing.assert_allclose((spectrum**2).mean(axis=0), 256 * amplitude**2, rtol=1e-10)


@pytest.mark.parametrize("speed", [-5.2, -0.4, 0.0, 3.3])
def test_speed_of_a_receding_point_is_read_back(speed):
    """Range grows with v, so the echo turns by -4 pi f v T_r / c a symbol: a fall in FFT frequency."""
    echo = np.exp(-4j * np.pi * CARRIER * speed * INTERVAL * np.arange(400) / SPEED_OF_LIGHT)
    frequency = (vrp(echo)[:, 70].argmax() - 128) / 256 / INTERVAL
    assert abs(frequency + 2 * CARRIER * speed / SPEED_OF_LIGHT) <= 0.5 / 256 / INTERVAL + 1e-9
    speeds = Spectra()["vt"].speeds_mps
    transition = np.abs(vt(echo, CARRIER, INTERVAL)[:, 70])
    # A steady point gains nothing at its own speed: |9|^2 (8/9)^2 - |8|^2 = 0.
    assert transition[np.abs(speeds - speed).argmin()] < 1e-9 * transition.max()
    # Figures print speeds along the rows, from that of the first row to that of the last.
    station = Station("A", (0.0, 0.0, 10.0), 0.0, CARRIER)
    network = Network(CARRIER, 30e3, 1, 0, INTERVAL, 400, (1, 1), (1, 1), 1.0, (station,))
    first, last = spectrum("vrp").speeds(Spectra()["vrp"], network, station)
    assert first + (last - first) * vrp(echo)[:, 70].argmax() / 255 == pytest.approx(
        speed, abs=(first - last) / 510
    )
    first, last = spectrum("vt").speeds(Spectra()["vt"], network, station)
    assert first + (last - first) * transition.argmin() / 122 == pytest.approx(speed, abs=1e-9)


def test_windows_are_one_fewer_than_usual_and_a_signal_without_one_is_refused_by_name():
    assert [windows(400, 256, 1, "vrp"), windows(400, 8, 1, "trp"), windows(400, 8, 3, "vt")] == [
        144,
        392,
        130,
    ]
    refused = (
        (lambda: vrp(noise(256)), "vrp.*256.*257"),
        (lambda: trp(noise(8)), "trp"),
        (lambda: vt(noise(8), CARRIER, INTERVAL), "vt"),
        (lambda: Spectra().check(256), "vrp"),
    )
    steps = Spectra(vrp=Fourier(256, 5, 256))
    steps.check(261)
    for call, words in (*refused, (lambda: steps.check(260), "at least 261 symbols")):
        with pytest.raises(InputError, match=f"spectrum .*{words}"):
            call()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_signal_that_is_not_finite_is_refused(value):
    signal = noise(400)
    signal[3] = value
    for function in (vrp, trp, lambda s: vt(s, CARRIER, INTERVAL)):
        with pytest.raises(InputError, match="NaN"):
            function(signal)
    with pytest.raises(InputError, match="expected"):
        trp(np.complex128(1))


def test_spectra_stand_in_the_catalogue_s_order_with_their_settings():
    assert [zero_index(name) for name in NAMES] == [0, 0, 128, *[0] * (len(NAMES) - 3)]
    short = Fourier(8, 3, 16)
    long = Fourier(64, 2, 128)
    two = Spectra(trp=short, vrp=long)
    assert list(two.items()) == [("vrp", long), ("trp", short)] and len(two) == 2
    assert vrp(noise(400), two).shape == (128, 168) and trp(noise(400), two).shape == (16, 130)
    with pytest.raises(InputError, match="none named"):
        Spectra.from_settings({})
    with pytest.raises(InputError, match="cwt"):
        Spectra.from_settings({"cwt": {}})


def test_settings_default_to_the_published_ones():
    assert Spectra.from_settings(SPECTRA) == Spectra()
    np.testing.assert_allclose(Spectra()["vt"].speeds_mps, np.arange(-61, 62) / 10, atol=1e-12)


@pytest.mark.parametrize(
    ("part", "change", "named"),
    rows("spectra", "settings"),
)
def test_wrong_settings_are_refused_by_name(part, change, named):
    with pytest.raises(InputError, match=named):
        Spectra.from_settings({**SPECTRA, part: {**SPECTRA[part], **change}})
