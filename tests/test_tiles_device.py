"""The renderer on PyTorch devices against the compiled one: every pixel equal."""

import numpy as np
import pytest

from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.spectra import Fourier, Spectra, Transfer
from lowalt.spectra.settings import RangeCells
from lowalt.tiles import Images, Renderer, Scale, split
from pictures import SCALES, echoes, renderer

torch = pytest.importorskip("torch")
from lowalt.tiles.device import DeviceRenderer, _power_of_two  # noqa: E402

DEVICES = ["cpu", *(["cuda"] if torch.cuda.is_available() else [])]


def batch():
    """Rotor-like echoes, noise alone, zeros, a constant, and levels at both ends of float32."""
    grain = np.random.default_rng(9).standard_normal((2, 3, 400))
    samples = [
        echoes(1), echoes(2, snr=2.0), grain[0] + 1j * grain[1], np.zeros((3, 400)), np.full((3, 400), 1 - 2j),
        echoes(3, level=1e-37), echoes(4, level=1e37),
    ]  # fmt: skip
    return np.stack(samples).astype(np.complex64)


def test_powers_of_two_are_exact_over_the_range_of_normal_numbers():
    exponents = torch.arange(-126, 128)
    assert _power_of_two(exponents).tolist() == [2.0**exponent for exponent in exponents.tolist()]


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("scale", SCALES, ids=lambda s: f"{s.name}{s.floor_db:g}")
def test_every_pixel_is_equal(device, scale):
    compiled, signals = renderer(scale), batch()
    found = DeviceRenderer(compiled, device).images(signals).cpu().numpy()
    for number, sample in enumerate(signals):
        np.testing.assert_array_equal(found[number], split(compiled.tile(sample), 3))


@pytest.mark.parametrize("device", DEVICES)
def test_other_windows_sizes_and_hops_are_equal(device):
    network = renderer().network
    spectra = Spectra(vrp=Fourier(64, 2, 128), trp=Fourier(4, 3, 64), vt=Transfer(5, 2, -3.0, 3.0, 0.25))
    compiled = Renderer(network, spectra, Images(100, Scale("linear")))
    found = DeviceRenderer(compiled, device).images(batch()[:2]).cpu().numpy()
    np.testing.assert_array_equal(found, [split(compiled.tile(sample), 3) for sample in batch()[:2]])
    assert isinstance(network, Network)


def test_range_profiles_are_refused():
    profiled = Renderer(renderer().network, Spectra(hrrp=RangeCells(1, 1, 9)), Images(100, Scale("linear")))
    with pytest.raises(InputError, match="none of range profiles on a device"):
        DeviceRenderer(profiled)


def test_wrong_batches_are_refused():
    device = DeviceRenderer(renderer())
    with pytest.raises(InputError, match="expected complex64"):
        device.images(batch()[0])
    with pytest.raises(InputError, match="expected complex64"):
        device.images(batch()[..., :399])
    bad = batch()
    bad[0, 0, 0] = np.nan
    with pytest.raises(InputError, match="NaN"):
        device.images(bad)
