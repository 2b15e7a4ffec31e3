"""Signals instead of images: their cache, their networks' symmetries, their augmentation, a training, a prediction."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from lowalt.recognition.augment_signals import augment_signals

from dataset import SNRS, build
from lowalt.common.errors import InputError
from lowalt.common.streams import stream
from lowalt.recognition import methods, one_sample, runs, schemes, signal_networks, slow_time
from lowalt.shards import ShardSet
from pictures import IMAGES, NETWORK, SPECTRA
from signal_trainings import share_right, sources, write_signals
from trainings import SETTINGS, with_training

METHODS = tuple(signal_networks.BACKBONES)
KEEP = {"mirror": 0.0, "shift_time": 0.0}


def scheme(method, stations="ABC", fusion="attention"):
    row = {"scheme": f"{stations}:{method}", "stations": stations, "spectra": "", "fusion": fusion, "backbone": ""}
    return schemes.scheme({**row, "protocols": "seen", "method": method, "size": "400"}, "test", "ABC")


def signals(count, stations=3, symbols=400, seed=0):
    rng = stream(seed, "signals")
    return torch.from_numpy((rng.standard_normal((count, stations, symbols, 2)) @ [1, 1j]).astype(np.complex64))


def network(method, **changes):
    torch.manual_seed(0)
    return methods.built(scheme(method, **changes), SETTINGS["network"], 400, "gray", 4).eval()


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Image shards next to their noisy signals, and signal shards of the same samples."""
    folder = tmp_path_factory.mktemp("data")
    return build(folder / "images", "image"), build(folder / "signals", "signal")


def test_a_cache_holds_the_shards_own_signals_and_features_whatever_the_kind_of_shard(data, tmp_path):
    images, stored = data
    line = ["--shard", "seen-train-00000.tar", "--settings", json.dumps({"snr_db": SNRS})]
    noisy = ["--noisy", f"{images}/seen.npy", "--motion", f"{images}/seen.csv"]
    slow_time.main([*line, "--index", str(images / "index.json"), *noisy, "--out", str(tmp_path / "images.npz")])
    slow_time.main([*line, "--index", str(stored / "index.json"), "--out", str(tmp_path / "signals.npz")])
    assert (tmp_path / "images.npz").read_bytes() == (tmp_path / "signals.npz").read_bytes()
    shards = ShardSet(stored / "index.json", ["seen"], ["train"])
    found = slow_time.SlowTimeSamples([tmp_path / "images.npz"], "signals", [0, 2], {("seen", "train")})
    assert found.size == 400 and len(found.facts) == len(shards)
    keys = [key.decode() for key in shards.keys]
    assert found.facts.key.tolist() == keys
    for number in range(len(shards)):
        assert (found.views(np.array([number]))[0] == shards.signal(number)[[0, 2]]).all()
    told = slow_time.SlowTimeSamples([tmp_path / "images.npz"], "features", [1], {("seen", "train")})
    assert told.views(np.arange(3)).shape == (3, 1, len(slow_time.NAMES)) and told.sha256() != found.sha256()
    before = found.sha256()
    found.values[1, 0, 7] += 1
    assert found.sha256() != before
    with pytest.raises(InputError, match="none of the 1 files has samples"):
        slow_time.SlowTimeSamples([tmp_path / "images.npz"], "signals", [0], {("unseen", "test")})
    with pytest.raises(InputError, match="3 stations, the scheme needs 5"):
        slow_time.SlowTimeSamples([tmp_path / "images.npz"], "signals", [4], {("seen", "train")})


@torch.inference_mode()
def test_a_complex_layer_is_its_formula_and_halves_the_symbols():
    """Convolution, unit mean power, then modReLU: the magnitude less a tenth, none below zero, the phase kept."""
    torch.manual_seed(2)
    layer = signal_networks.ComplexConvolution(2, 3, 5, 2)
    given = signals(2, stations=2, symbols=24)
    found = layer(given).numpy()
    assert found.shape == (2, 3, 12)
    padded = np.pad(given.numpy(), ((0, 0), (0, 0), (2, 2)))
    weight = layer.real.numpy() + 1j * layer.imaginary.numpy()
    plain = np.stack([np.einsum("bck,ock->bo", padded[..., start : start + 5], weight) for start in range(0, 24, 2)], 2)
    plain /= np.sqrt((abs(plain) ** 2).mean((1, 2), keepdims=True))
    size = abs(plain)
    np.testing.assert_allclose(found, plain * np.maximum(size - 0.1, 0) / size, atol=2e-5)
    assert layer.real.numel() == 2 * 3 * 5


@torch.inference_mode()
@pytest.mark.parametrize(("method", "numbers"), [("cnn", 55_272), ("complex", 53_856), ("transformer", 104_256)])
def test_networks_of_signals_keep_their_size_and_every_convolution_halves_the_symbols(method, numbers):
    """Kept trainings hold weights of just these sizes."""
    backbone = signal_networks.BACKBONES[method](400)
    assert sum(value.numel() for value in backbone.parameters()) == numbers
    if method != "transformer":
        given = signals(1)[:, :1] if method == "complex" else torch.zeros(1, 2, 400)
        assert backbone.layers(given).shape == (1, backbone.width // 2, 400 / 2**4)


@torch.inference_mode()
def test_weights_begin_as_wide_as_their_sources_say_and_magnitudes_are_pooled():
    """Complex weights of unit output power, places of a fiftieth; a piece of 16 symbols is the least signal."""
    torch.manual_seed(3)
    layer = signal_networks.ComplexConvolution(8, 64, 9, 1)
    for part in (layer.real, layer.imaginary):
        assert float(part.std()) == pytest.approx((2 * 8 * 9) ** -0.5, rel=0.03)
    assert float(signal_networks.Pieces(4000).place.std()) == pytest.approx(0.02, rel=0.03)
    assert signal_networks.Pieces(16)(signals(2, symbols=16)[:, 0]).shape == (2, 64)
    with pytest.raises(InputError, match="signals of 15 symbols, expected at least 16"):
        signal_networks.Pieces(15)
    backbone, given = signal_networks.ComplexConvolutions(400), signals(2)[:, 0]
    size = backbone.layers(given.unsqueeze(1)).abs()
    torch.testing.assert_close(backbone(given), torch.cat([size.mean(-1), size.amax(-1)], 1), atol=2e-3, rtol=0)


@torch.inference_mode()
@pytest.mark.parametrize("method", METHODS)
def test_the_size_of_a_signal_changes_nothing_and_stations_may_be_swapped(method):
    model, given = network(method), signals(3)
    found = model(given)
    assert found.shape == (3, 4)
    torch.testing.assert_close(model(given * 3e-6), found, atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(model(given[:, [2, 0, 1]]), found, atol=1e-5, rtol=1e-4)
    assert (model(torch.zeros_like(given)).isfinite()).all()
    assert not torch.allclose(model(signals(3, seed=1)), found, atol=1e-4)


@torch.inference_mode()
@pytest.mark.parametrize("method", METHODS)
def test_only_the_complex_network_does_not_see_a_signal_s_phase(method):
    model, given = network(method), signals(3)
    turned = model(given * torch.exp(torch.tensor(1.3j)).to(torch.complex64))
    assert torch.allclose(turned, model(given), atol=1e-5) == (method == "complex")


def test_a_complex_convolution_is_that_of_complex_numbers():
    torch.manual_seed(1)
    layer = signal_networks.ComplexConvolution(1, 2, 3, 1)
    given = signals(1, 1, 10)
    weight = (layer.real + 1j * layer.imaginary).detach().numpy()
    plain = [np.correlate(np.pad(given[0, 0].numpy(), 1), weight[k, 0].conj(), "valid") for k in range(2)]
    power = np.mean(np.abs(plain) ** 2)
    wanted = np.array(plain) / np.sqrt(power)
    wanted *= np.maximum(np.abs(wanted) - 0.1, 0) / np.abs(wanted)
    np.testing.assert_allclose(layer(given)[0].detach().numpy(), wanted, atol=1e-4)


def test_augmented_signals_are_mirrored_shifted_and_turned_alike_for_all_stations():
    given = signals(6).numpy()
    same = augment_signals(given, KEEP, stream(1, "a"))
    ratio = same / given
    np.testing.assert_allclose(ratio, ratio[..., :1] * np.ones(400), atol=1e-5)
    np.testing.assert_allclose(abs(ratio), 1, atol=1e-5)
    assert len(np.unique(np.angle(ratio[..., 0]).round(3))) == 18
    mirrored = augment_signals(given, {**KEEP, "mirror": 1.0}, stream(1, "a"))
    np.testing.assert_allclose(mirrored, same.conj(), atol=1e-6)
    shifted = augment_signals(given, {**KEEP, "shift_time": 0.5}, stream(1, "a"))
    for one, other in zip(shifted, same, strict=True):
        steps = [shift for shift in range(400) if np.allclose(one, np.roll(other, shift, -1))]
        assert len(steps) == 1
    assert (augment_signals(given, KEEP, stream(1, "a")) == same).all()


@pytest.mark.parametrize("method", METHODS)
def test_a_short_training_learns_turns_of_the_phase_and_its_model_is_read_back(method, tmp_path):
    path = write_signals(tmp_path / "a.npz")
    mine = replace(scheme(method), size=64)
    settings = {**with_training(steps=60, validate_every=30), "size": 64}
    runs.train(sources(path, "signals"), mine, "seen", settings, tmp_path / "out")
    trained = runs.load(tmp_path / "out/model.pt")
    assert share_right(trained, path, "signals", "fp32", tmp_path / "out.csv") > 0.9
    assert json.loads((tmp_path / "out/run.json").read_text())["backbone"] == method
    signal = np.load(path)["signals"][-1]
    np.save(tmp_path / "one.npy", signal)
    blocks = {"network": {**NETWORK, "symbols": 64}, "spectra": SPECTRA, "images": IMAGES}
    shares = one_sample.predict(trained, tmp_path / "one.npy", blocks)
    assert max(shares, key=shares.get) == "Pedestrian"
    with pytest.raises(InputError, match="expected \\(3, 400\\)"):
        one_sample.predict(trained, tmp_path / "one.npy", {**blocks, "network": NETWORK})


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"method": "rnn"}, "method 'rnn', expected"), ({"spectra": "VRP"}, "spectra 'VRP' with method 'cnn'"),
     ({"method": "svm"}, "fusion 'mean' with method 'svm', expected concatenation")],
)  # fmt: skip
def test_rows_that_contradict_their_method_are_refused_by_name(changes, words):
    row = {"scheme": "x", "stations": "A", "spectra": "", "fusion": "mean", "backbone": "", "protocols": "seen"}
    with pytest.raises(InputError, match=words):
        schemes.scheme({**row, "method": "cnn", **changes}, "test", "ABC")
