"""The raw echo of a target: equal to the data set's, its axes read back out of the signal, its
files, its refusals.
"""

import warnings

import numpy as np
import pytest

import lowalt
from lowalt.__main__ import main
from lowalt.config.layers import overlaid
from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.files.errors import InputError
from lowalt.shards import kept_datasets
from lowalt.shards import receive as module
from lowalt.spectra.cube import TRUTH
from options import words

CAR = "AITO M9 2024"
DRONE = "DJI Mini 2"
SMALL = {"network": {"symbols": 64, "subcarriers": 64}, "targets": {"select": [CAR, DRONE]}}
FMCW = {
    "subcarriers": None,
    "waveform": {"kind": "fmcw", "sweep_hz": 100e6, "sweep_s": 2e-5, "samples": 64},
    "symbol_interval_s": 1e-4,
}
RECEIVER = {"adc": {"bits": 3}, "carrier_offset": {}, "clutter": {}, "canceller": {"kind": "mean"}}


def made(*more):
    """The data set of two targets, with overlays."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return lowalt.Dataset(overlaid([SMALL, *more]))


@pytest.fixture(scope="module")
def plain():
    """Two targets and no effects, symbols so close that no body's speed folds."""
    return made({"network": {"symbol_interval_s": 1e-3}})


@pytest.fixture(scope="module")
def scene():
    """Two targets in a scene with clutter, a receiver with faults, and a canceller."""
    return made({"effects": RECEIVER})


def test_the_places_of_the_chain_follow_from_one_another_and_end_in_the_data_set_s_signal(scene):
    found = {at: lowalt.receive(scene, CAR, 4, "B", at) for at in module.AT}
    assert {echo.values.shape for at, echo in found.items() if at != "signal"} == {(64, 64)}
    cells = np.asarray(found["cells"])
    assert (
        abs(cells - np.fft.ifft(found["receiver"].values, axis=1)).max() < 1e-12 * abs(cells).max()
    )
    # A mean canceller takes the mean over the symbols out; the faults are the receiver's.
    assert (
        abs(found["canceller"].values - cells + cells.mean(axis=0)).max() < 1e-9 * abs(cells).max()
    )
    assert (
        abs(found["receiver"].values - found["subcarriers"].values).max() > 0.01 * abs(cells).max()
    )
    signal = scene.maker.signal(scene.row(scene.place_of(CAR, 4, np.inf)), np.inf, [1])[1]
    assert (found["signal"].values.astype(np.complex64) == signal).all()
    there = abs(found["canceller"].values).argmax(axis=1)
    assert (found["canceller"].values[np.arange(64), there].astype(np.complex64) == signal).all()


def test_noise_of_a_set_snr_is_the_data_set_s_and_white_before_the_cells_are_chosen(plain):
    row = plain.row(plain.place_of(CAR, 1, 3.0))
    signal = plain.maker.signal(row, 3.0)
    assert (
        lowalt.receive(plain, CAR, 1, at="signal", snr_db=3.0).values.astype(np.complex64)
        == signal[0]
    ).all()
    cube = plain.maker.cubes(row, 3.0, signal)[0].cells
    assert (lowalt.receive(plain, CAR, 1, at="canceller", snr_db=3.0).values == cube).all()
    clean, noisy = (
        lowalt.receive(plain, CAR, 1, at="receiver", snr_db=snr).values for snr in (np.inf, 3.0)
    )
    chosen = lowalt.receive(plain, CAR, 1, at="signal").values
    # M subcarriers of M times the noise of a range cell.
    level = np.mean(abs(noisy - clean) ** 2) / 64
    np.testing.assert_allclose(level, np.mean(abs(chosen) ** 2) / 10**0.3, rtol=0.06)
    cells = lowalt.receive(plain, CAR, 1, at="cells", snr_db=3.0).values
    assert abs(cells - np.fft.ifft(noisy, axis=1)).max() < 1e-12 * abs(cells).max()


@pytest.mark.parametrize("network", [{"symbol_interval_s": 1e-3}, FMCW], ids=["OFDM", "FMCW"])
def test_a_range_doppler_map_on_the_echo_s_axes_peaks_at_the_observed_truth(network):
    echo = lowalt.receive(made({"network": network}), CAR, 2, at="cells")
    window = np.hanning(64)[:, None]
    power = abs(np.fft.fftshift(np.fft.fft(window * echo.values, axis=0), axes=0)[::-1])
    speed, cell = np.unravel_index(power.argmax(), power.shape)
    step = echo.speeds_mps[1] - echo.speeds_mps[0]
    assert abs(echo.speeds_mps[speed] - echo.truth["observed_mps"].mean()) < 1.5 * step
    apart = cell - echo.truth["observed_cell"].mean()
    assert abs(apart - 64 * np.rint(apart / 64)) < 2
    assert echo.ranges_m[1] == pytest.approx(
        SPEED_OF_LIGHT / (2 * 64 * (120e3 if network is not FMCW else 100e6 / 64))
    )


def test_phases_over_frequencies_and_symbols_are_those_of_the_stated_signs(plain):
    echo = lowalt.receive(plain, CAR, 2, at="subcarriers")
    y = echo.values
    delay_s = 2 * echo.truth["range_m"] / SPEED_OF_LIGHT
    step = np.angle(
        (y[:, 1:] * y[:, :-1].conj()).sum(axis=1) * np.exp(2j * np.pi * 120e3 * delay_s)
    )
    # The car's points are up to 3 m from its middle, so within 3 m x 4 pi df / c.
    assert abs(step).max() < 4 * np.pi * 120e3 / SPEED_OF_LIGHT * 3
    middle_hz = echo.frequencies_hz.mean()
    turned = np.angle((y[1:] * y[:-1].conj()).sum()) / (2 * np.pi * 1e-3)
    assert abs(-turned * SPEED_OF_LIGHT / (2 * middle_hz) - echo.truth["observed_mps"].mean()) < 1.0


def test_a_continuous_wave_has_one_subcarrier(plain):
    wave = {"waveform": {"kind": "cw"}, "symbol_interval_s": 1e-3}
    echo = lowalt.receive({**SMALL, "network": {"symbols": 64, **wave}}, CAR, 2, at="subcarriers")
    near = lowalt.receive(plain, CAR, 2, at="subcarriers")
    assert echo.values.shape == (64, 1) and echo.frequencies_hz.tolist() == [4.9e9]
    assert abs(echo.values[:, 0] - near.values[:, 0]).max() < 1e-9 * abs(near.values).max()


def test_parts_move_with_the_target_and_rotors_no_faster_than_their_tips(plain):
    echo = lowalt.receive(plain, DRONE, 3)
    row = plain.row(plain.place_of(DRONE, 3, np.inf))
    truth = echo.truth
    body = echo.parts.index("body")
    rotors = [n for n, name in enumerate(echo.parts) if name != "body"]
    low = truth["part_low_mps"]
    high = truth["part_high_mps"]
    # A rigid body flies straight, and its parts' ranges change by their speeds.
    moved = np.gradient(truth["part_range_m"][:, body], echo.times_s)
    assert ((low[:, body] - 1e-3 < moved) & (moved < high[:, body] + 1e-3)).all()
    np.testing.assert_allclose((low + high)[:, rotors].mean() / 2, moved.mean(), atol=0.5)
    rates = np.array(
        [value for name, value in row.items() if name.startswith("rate") and value > 0]
    )
    tip_mps = np.pi * 0.109 * 0.2192 / 0.213 * rates.max()
    assert 0.3 * tip_mps < (high - low)[:, rotors].max() / 2 < 1.1 * tip_mps


def test_layers_may_be_dicts_and_a_bandwidth_stands_for_subcarriers():
    config = overlaid([{"network": {"bandwidth_hz": "9.6e6"}}])
    assert config["network"]["subcarriers"] == 80 and "bandwidth_hz" not in config["network"]
    assert overlaid([config])["network"]["subcarriers"] == 80
    with pytest.raises(
        InputError, match=r"network.bandwidth_hz: 1 is 0 subcarriers, expected 1 to 100000"
    ):
        overlaid([{"network": {"bandwidth_hz": 1}}])
    with pytest.raises(InputError, match=r"network.bandwidth_hz.*of OFDM only"):
        overlaid(["config/scenes/fmcw.yaml", {"network": {"bandwidth_hz": 1e6}}])


def test_speeds_that_fold_are_named_with_an_interval_at_which_none_does():
    block = overlaid([{"network": {"carrier_hz": 28e9}}])["network"]
    rows = [dict.fromkeys(("vx_abs_max", "vy_abs_max", "vz_abs_max"), 3.0) | {"speed_hi": None}]
    said = Network.from_settings(block).folding(rows)
    assert said.startswith("radial speeds beyond 1.07 m/s fold, targets move at up to 5.2 m/s")
    interval = float(said.split(" at ")[-1].split()[0])
    assert Network.from_settings({**block, "symbol_interval_s": interval}).folding(rows) == ""
    with pytest.warns(UserWarning, match=r"beyond 1.07 m/s fold, targets move at up to 20 m/s"):
        lowalt.Dataset(overlaid([SMALL, {"network": {"carrier_hz": 28e9, "subcarriers": 1}}]))


def test_ranges_that_fold_are_named_with_a_value_at_which_none_does():
    overlay = {
        "network": {
            "waveform": {"kind": "fmcw", "sweep_hz": 150e6, "sweep_s": 2e-3, "samples": 128}
        }
    }
    with pytest.warns(UserWarning) as caught:
        echo = lowalt.receive(overlay, "Crow", 0, "A", "cells")
    said = next(str(one.message) for one in caught if "ranges" in str(one.message))
    # The warning points at the user's line, and holds: the crow's echo stands in a cell nearer than
    # the crow is.
    assert {one.filename for one in caught} == {__file__}
    assert said.startswith("ranges beyond 127.9 m fold, targets are up to 500 m from a station")
    assert echo.truth["range_m"][0] > 400 > 127.9 > echo.ranges_m[abs(echo.values[0]).argmax()]
    none = int(said.split(", at ")[1].split()[0])
    for samples, folds in ((none, False), (none - 1, True)):
        overlay["network"]["waveform"]["samples"] = samples
        assert (
            bool(Network.from_settings(overlaid([overlay])["network"]).range_folding(None)) == folds
        )
    ofdm = overlaid([{"network": {"subcarrier_spacing_hz": 400e3}}])["network"]
    spacing = float(Network.from_settings(ofdm).range_folding(None).split(", at ")[1].split()[0])
    for hertz, folds in ((spacing, False), (spacing + 1, True)):
        assert (
            bool(Network.from_settings(ofdm | {"subcarrier_spacing_hz": hertz}).range_folding(None))
            == folds
        )
    near = Network.from_settings(ofdm).range_folding([[200, 100], [300, 100], [250, 200]])
    assert near == "", "a region inside 375 m of every mast"


def test_the_command_writes_every_array_by_name(tmp_path, capsys):
    small = tmp_path / "small.yaml"
    small.write_text("network: {symbols: 64, subcarriers: 64}\n")
    given = {"raw": "receiver", "station": "C", "overlay": small, "out": tmp_path}
    line = words("sample", CAR, "2", **given)
    assert main(line) == 0
    files = [tmp_path / f"aito-m9-2024-000002-snrinf-C-receiver.{kind}" for kind in ("npz", "h5")]
    assert capsys.readouterr().out.split() == list(map(str, files))
    echo = lowalt.receive(small, CAR, 2, "C", "receiver")
    read = pytest.importorskip("h5py").File(files[1])
    with np.load(files[0]) as held:
        assert set(held) == set(read) == set(echo.arrays())
        for name, array in echo.arrays().items():
            np.testing.assert_array_equal(held[name], array)
            if array.dtype.kind != "U":
                np.testing.assert_array_equal(read[name][()], array)
    assert read["parts"].asstr()[0] == echo.parts[0] and read["unit"].asstr()[()] == "sqrt(W)"


@pytest.mark.parametrize("symbols", [1, 2])
@pytest.mark.parametrize(
    "network, effects",
    [({"symbol_interval_s": 1e-4}, {}), (FMCW, {"symbol_motion": {}})],
    ids=["OFDM", "FMCW"],
)
def test_one_or_two_symbols_have_the_truth_of_the_first_symbols_of_many(symbols, network, effects):
    """A rigid body that flies straight has the same range, speed and cell, however long the look
    lasts, and so have its cubes.
    """
    many = made({"network": network, "effects": effects})
    few = made({"network": network | {"symbols": symbols}, "effects": effects})
    expected = lowalt.receive(many, CAR, 2, at="receiver")
    found = lowalt.receive(few, CAR, 2, at="receiver")
    assert found.values.shape == (symbols, 64)
    assert abs(expected.truth["observed_mps"]).min() > 1
    for name, values in found.truth.items():
        wanted = expected.truth[name][:symbols]
        np.testing.assert_allclose(values, wanted, rtol=1e-6, atol=2e-4, err_msg=name)
    row = few.row(few.place_of(CAR, 2, 3.0))
    cube = few.maker.cubes(row, 3.0, few.maker.signal(row, 3.0))[0]
    assert (cube.truth == np.column_stack([found.truth[name] for name in TRUTH])).all()


def test_an_echo_has_names_and_truth_of_companions_as_cubes_have():
    dataset = made({"effects": {"companions": {"subtypes": [DRONE], "count": [2, 2]}}})
    echo = lowalt.receive(dataset, CAR, 1, "B")
    row = dataset.row(dataset.place_of(CAR, 1, np.inf))
    cube = dataset.maker.cubes(row, np.inf, dataset.maker.signal(row, np.inf))[1]
    assert echo.companions == (DRONE, DRONE)
    for place, name in enumerate(TRUTH):
        expected = np.array([other[:, place] for other in cube.others])
        np.testing.assert_array_equal(echo.others[name], expected)
        np.testing.assert_array_equal(echo.arrays()[f"others_{name}"], expected)
    lonely = lowalt.receive(made(), CAR, 1)
    assert lonely.companions == () and lonely.others["range_m"].shape == (0, 64)


def test_a_configuration_is_checked_once_and_again_when_a_file_of_it_changes(tmp_path, monkeypatch):
    """The second call reads no record, also for another subtype; the content of a layer and of a
    file that it names decides.
    """
    checks = []

    def counted(*arguments):
        checks.append(arguments)
        return records_of(*arguments)

    records_of = kept_datasets.records_of
    monkeypatch.setattr(kept_datasets, "records_of", counted)
    monkeypatch.setattr(kept_datasets, "_kept", {})
    effect = tmp_path / "loss.py"
    text = (
        "SOURCE = 'test'\nDEFAULTS = {}\n"
        "def visible(settings, view, rng):\n    return FACTOR * (view.ways_m(view.places) > 0)\n"
    )
    effect.write_text(text.replace("FACTOR", "1.0"))
    scene = tmp_path / "scene.yaml"
    scene.write_text(f"network: {{symbols: 64, subcarriers: 64}}\neffects: {{{effect}: {{}}}}\n")
    first = lowalt.receive(scene, CAR, 1).values
    assert (lowalt.receive(scene, CAR, 1).values == first).all()
    lowalt.receive(scene, DRONE, 1)
    assert len(checks) == 1
    effect.write_text(text.replace("FACTOR", "0.5"))
    np.testing.assert_allclose(lowalt.receive(scene, CAR, 1).values, 0.5 * first, rtol=1e-9)
    assert len(checks) == 2
    scene.write_text(scene.read_text().replace("symbols: 64", "symbols: 32"))
    assert len(lowalt.receive(scene, CAR, 1).values) == 32
    assert len(checks) == 3


def test_a_layer_that_is_changed_in_place_is_another_configuration():
    layer = {"network": {"symbols": 64, "subcarriers": 64, "stations": {}}}
    first = lowalt.receive(layer, CAR, 1)
    layer["network"]["subcarriers"] = 32
    assert lowalt.receive(layer, CAR, 1).values.shape == (64, 32)
    layer["network"]["subcarriers"] = 64
    assert (lowalt.receive(layer, CAR, 1).values == first.values).all()


def test_no_layers_at_all_are_the_embedded_default():
    network = kept_datasets.dataset_of_subtype([], CAR).maker.network
    assert network == Network.from_settings(overlaid([])["network"])


@pytest.mark.parametrize(
    ("subtype", "model", "given", "said"),
    [
        (CAR, 0, {"at": "range"}, r"at is 'range', expected one of \['subcarriers', 'receiver'"),
        (CAR, -1, {}, "model is -1, expected a whole number from 0"),
        ("Crow", 0, {}, "subtype is 'Crow', expected one of"),
        (CAR, 0, {"station": "D"}, r"station 'D': not in the network, which has \['A', 'B', 'C'\]"),
    ],
)
def test_wrong_words_are_refused(plain, subtype, model, given, said):
    with pytest.raises(InputError, match=said):
        lowalt.receive(plain, subtype, model, **given)


def test_a_subtype_of_the_default_that_is_misspelt_is_refused_with_the_right_name():
    with pytest.raises(InputError, match=r"expected perhaps \['Crow'\]"):
        lowalt.receive({}, "Krow")
