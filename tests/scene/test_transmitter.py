"""What a station sends, and when: data, amplifier, combs of pilots, late or missing symbols."""

import numpy as np
import pytest
from scipy.integrate import quad

from lowalt.numerics.streams import stream
from lowalt.scene import waveform
from lowalt.scene.effects.transmitter import comb_pilots, data_symbols, power_amplifier, slow_time
from scenes import network


@pytest.mark.parametrize(("order", "rise_db"), [(16, 2.76), (64, 4.29)])
def test_qam_has_mean_power_one_and_raises_the_noise_of_weak_symbols(order, rise_db):
    points = data_symbols.constellation(order)
    assert len(set(points.round(9))) == order and np.mean(abs(points) ** 2) == pytest.approx(1.0)
    assert 10 * np.log10(np.mean(abs(points) ** -2.0)) == pytest.approx(rise_db, abs=0.01)
    sent = data_symbols.data({"order": order}, 300, 32, stream(1, "q"))
    assert np.mean(abs(sent) ** -2.0) == pytest.approx(10 ** (rise_db / 10), rel=0.03)


def test_an_amplifier_passes_weak_signals_and_never_exceeds_saturation():
    small = 1e-4 * np.exp(2j * np.pi * np.linspace(0, 1, 9))
    np.testing.assert_allclose(power_amplifier.rapp(small, 1.0), small, rtol=1e-12)
    loud = power_amplifier.rapp(np.array([1.0, 1j, 1e3]), 1.0)
    np.testing.assert_allclose(abs(loud[:2]), 2**-0.25, rtol=1e-12)
    assert abs(loud[2]) == pytest.approx(1.0, rel=1e-3)


def test_an_amplifier_leaves_a_smaller_copy_of_the_data_and_distortion_as_bussgang_says():
    sent = waveform.qpsk(stream(1, "d"), 40, 256)
    aired = power_amplifier.aired({"backoff_db": 3.0}, sent)

    def mean(of):
        """Mean over a Gaussian signal of a function of a sample's power and of what comes out."""
        return quad(lambda u: of(u, u / np.sqrt(1 + (u / 10**0.3) ** 2)) * np.exp(-u), 0, 60)[0]

    gain = mean(lambda u, out: np.sqrt(u * out))
    distortion = mean(lambda u, out: out) - gain**2
    copy = np.mean(aired * sent.conj())
    assert copy == pytest.approx(gain, abs=0.01)
    # A part of the distortion lies outside the band.
    assert 0.5 * distortion < np.mean(abs(aired - copy * sent) ** 2) < distortion
    np.testing.assert_allclose(power_amplifier.aired({"backoff_db": 60.0}, sent), sent, atol=1e-5)


def test_a_comb_folds_ranges_and_keeps_amplitude_and_phase():
    for cell in (3, 5 + 8, 6 + 16):
        response = np.exp(-2j * np.pi * np.arange(32) * cell / 32)[None]
        whole = np.fft.ifft(response)[0]
        cells = comb_pilots.range_cells({"spacing": 4, "offset": 1}, response)[0]
        assert cells.shape == (8,) and abs(cells).argmax() == cell % 8
        expected = whole[cell] * np.exp(-2j * np.pi * (cell - cell % 8) / 32)
        assert cells[cell % 8] == pytest.approx(expected, abs=1e-12)


def test_symbols_are_sent_in_the_downlink_and_late_by_no_more_than_the_jitter():
    radio = network(symbols=400)
    settings = slow_time.DEFAULTS | {"missing": 0.1, "jitter_s": 1e-4}
    timing = slow_time.sampling(settings, radio, stream(1, "t"))
    late = timing.times_s - radio.times_s
    assert late.min() >= 0 and 0.9e-4 < late.max() < 1e-4
    phase = np.arange(400) % 4
    assert not timing.present[phase == 3].any() and timing.present[
        phase < 3
    ].mean() == pytest.approx(0.9, abs=0.05)
    fewest = slow_time.sampling(settings | {"missing": 1.0}, radio, stream(1, "t"))
    assert np.flatnonzero(fewest.present).tolist() == [0, 1]


def test_regridding_restores_a_line_as_far_as_its_kind_can():
    radio = network(symbols=400)
    timing = slow_time.sampling(slow_time.DEFAULTS | {"jitter_s": 2e-4}, radio, stream(1, "t"))

    def regridded(kind, hz):
        received = np.exp(2j * np.pi * hz * timing.times_s[timing.present])
        return slow_time.regridded({"regrid": kind}, received, timing, radio)

    truth = np.exp(2j * np.pi * 2.0 * radio.times_s)
    zero = regridded("zero", 2.0)
    assert not zero[~timing.present].any() and abs(zero - truth)[timing.present].max() < 0.01
    line = np.fft.fft(regridded("nudft", 190.0))
    assert abs(line).argmax() == 190 and abs(line[190]) == pytest.approx(
        timing.present.sum(), rel=1e-9
    )
