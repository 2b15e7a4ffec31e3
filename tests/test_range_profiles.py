"""Range profiles as a fourth image: their noise, their spectrum, and the same bytes from the stage and on the spot."""

import pickle

import numpy as np
import pytest

from lowalt.config.layers import canonical
from lowalt.echo import Rigid, range_profile
from lowalt.files.atomic import slug
from lowalt.files.errors import InputError
from lowalt.motion import poses, write_table
from lowalt.noise.profile import noisy_profile
from lowalt.shards.build import rows_of
from lowalt.shards.dataset import Dataset
from lowalt.spectra import Spectra, spectrum
from lowalt.spectra.kinds import hrrp
from lowalt.targets.cloud import write as write_cloud
from lowalt.tiles.__main__ import main as tiles
from lowalt.tiles.files import Tiles
from lowalt.tiles.png import decode
from lowalt.tiles.profiles import Profiles, profile_cells
from lowalt.tiles.render import Renderer, split
from lowalt.workflow.refusals import refuse_profiles
from test_dataset import configuration

HRRP = {"window": 2, "hop": 1, "cells": 9}
SNRS = [3.0, float("inf")]


@pytest.fixture(scope="module")
def dataset():
    """Two motion models of two subtypes with four images a station, at a band of cells of 0.6 m."""
    config = configuration()
    config["targets"]["select"] = ["DJI Mini 2", "Owl"]
    config["motion"] |= {"models": 2, "models_per_chunk": 2}
    config["split"] = {"by": "motion", "train": 1, "val": 0, "test": 1}
    config["network"] |= {"subcarriers": 512, "subcarrier_spacing_hz": 480e3}
    config["images"] |= {"size": 32}
    config["spectra"] |= {"hrrp": HRRP}
    return Dataset(config)


def without(config: dict) -> dict:
    return config | {"spectra": {name: block for name, block in config["spectra"].items() if name != "hrrp"}}


def test_images_hold_the_profile_fourth_and_the_other_three_as_without_it(dataset):
    three = Dataset(without(dataset.config), dataset.clouds)
    for number in (0, 3):
        sample, plain = dataset[number], three[number]
        found, old = split(sample.image, 4).reshape(3, 4, 32, 32), split(plain.image, 3).reshape(3, 3, 32, 32)
        assert (found[:, :3] == old).all() and (sample.signal == plain.signal).all()
        assert sample.record == plain.record
        # The strongest cell is the middle one, where the image is brightest on average.
        assert np.isin(found[:, 3].astype(float).mean(axis=2).argmax(axis=1), (15, 16)).all()


def test_the_tiles_stage_draws_what_a_data_set_draws_on_the_spot(dataset, tmp_path):
    chunk = next(iter(dataset.plan.chunks))
    rows, block = rows_of(dataset, chunk), {name: dataset.config[name] for name in ("network", "spectra", "images")}
    write_table(tmp_path / "motion.csv", rows)
    clouds = [tmp_path / f"{slug(name)}.npz" for name in dataset.clouds]
    for path, cloud in zip(clouds, dataset.clouds.values(), strict=True):
        write_cloud(path, cloud)
    signals = np.stack([[dataset.maker.signal(row, snr) for snr in SNRS] for row in rows])
    np.save(tmp_path / "noisy.npy", signals)
    profiled = {"profiled": {"seed": dataset.plan.seed, "snr_db": ["inf" if np.isinf(one) else one for one in SNRS]}}
    files = "--signals", tmp_path / "noisy.npy", "--motion", tmp_path / "motion.csv", "--clouds", *clouds
    tiles(["--settings", canonical({**block, **profiled}), *map(str, files), "--out", str(tmp_path / "tiles.npz")])
    found, again = Tiles(tmp_path / "tiles.npz"), pickle.loads(pickle.dumps(dataset.maker))
    pairs = [(row, level) for row in range(len(rows)) for level in range(2)]
    for number, (row, level) in enumerate(pairs):
        assert found[number] == again.png(signals[row, level], rows[row], SNRS[level])
    assert decode(found[0])[0].shape == (3 * 32, 4 * 32)


def test_noise_has_the_power_of_the_snr_in_every_cell_and_the_signal_in_the_middle():
    rng = np.random.default_rng(2)
    profile, signal = np.zeros((4000, 7), complex), rng.normal(size=4000) + 0j
    profile[:, 3] = 2.0
    found = noisy_profile(profile, signal, 6.0, rng)
    assert (found[:, 3] == signal).all()
    others = np.delete(found, 3, axis=1)
    np.testing.assert_allclose((abs(others) ** 2).mean(axis=0), 4.0 / 10**0.6, rtol=0.06)
    assert abs(np.corrcoef(others.T) - np.eye(6)).max() < 0.06
    assert (noisy_profile(profile, profile[:, 3], np.inf, None) == profile).all()
    for wrong in (profile[:, :6], profile[:, 3]):
        with pytest.raises(InputError, match=r"expected \(N, odd\) and \(N,\)"):
            noisy_profile(wrong, signal, 6.0, rng)


def test_magnitudes_are_those_of_the_echo_s_profile(dataset):
    row, maker = dataset.row(dataset.place(1)), dataset.maker
    made = Profiles(maker.network, dataset.clouds, 5, 9)
    found = made.magnitudes(row, np.inf, maker.signal(row, np.inf))
    cloud, times = dataset.clouds[row["subtype"]], maker.network.times_s
    motion = Rigid(*poses(cloud, row, times), cloud.points, cloud.part)
    aim = np.array([row["x_m"], row["y_m"], row["z_m"]])
    for place, station in enumerate(maker.network.stations):
        truth = abs(range_profile(maker.network, station, motion, cloud.rcs_m2, aim, 9).values.T)
        np.testing.assert_allclose(found[place], truth / truth.max(), atol=1e-6)
    noisy = [made.magnitudes(row, snr, maker.signal(row, snr)) for snr in (3.0, 3.0, 8.0)]
    assert (noisy[0] == noisy[1]).all() and not np.allclose(noisy[0], noisy[2], atol=0.05)
    other = Profiles(maker.network, dataset.clouds, 6, 9).magnitudes(row, 3.0, maker.signal(row, 3.0))
    # The noise of the middle cell is the signal's, the noise of the others follows the seed.
    same = [np.allclose(other[0, cell] / other[0, 4], noisy[0][0, cell] / noisy[0][0, 4]) for cell in range(9)]
    assert same == [cell == 4 for cell in range(9)]


def test_every_station_draws_noise_of_its_own(dataset, monkeypatch):
    row, maker = dataset.row(dataset.place(1)), dataset.maker
    drawn = []
    monkeypatch.setattr(
        "lowalt.tiles.profiles.noisy_profile",
        lambda profile, signal, snr, rng: drawn.append(rng.normal()) or np.ones_like(profile),
    )
    Profiles(maker.network, dataset.clouds, 5, 9).magnitudes(row, 3.0, np.ones((3, maker.network.symbols)))
    assert len(set(drawn)) == 3


def test_no_more_motion_models_are_kept_than_asked_for(dataset):
    made = Profiles(dataset.maker.network, dataset.clouds, 5, 9, kept=2)
    rows = [dataset.row(dataset.place(number)) for number in range(len(dataset))]
    keys = list(dict.fromkeys((row["subtype"], row["model"]) for row in rows))
    for row in rows:
        made.clean(row)
        assert (row["subtype"], row["model"]) in made._clean and len(made._clean) <= 2
    assert len(keys) > 2
    assert list(made._clean) == keys[-2:]


def test_the_kernel_is_the_definition(dataset):
    values = abs(np.random.default_rng(1).normal(size=(9, 40))).astype(np.float32)
    for settings in (hrrp.Settings(1, 1, 9), hrrp.Settings(5, 1, 9)):
        out = np.empty((9, 40 - settings.window), np.float32)
        hrrp.fill_profile(values, settings, out)
        np.testing.assert_allclose(out, hrrp.definition(values, settings, "hrrp", 1.0, 1.0), rtol=1e-6)
    assert hrrp.definition(values, hrrp.Settings(5, 3, 9), "hrrp", 1.0, 1.0).shape == (9, 11)
    assert hrrp.speeds(hrrp.Settings(1, 1, 9), 1.0, 1.0) == (-4.0, 4.0) and hrrp.rows(hrrp.DEFAULTS) == 33
    for wrong in (values[:8], values[0], values[:, :1]):
        with pytest.raises(InputError, match="expected"):
            hrrp.definition(wrong, hrrp.Settings(1, 1, 9), "hrrp", 1.0, 1.0)


def test_a_signal_alone_gives_no_profile(dataset):
    renderer = Renderer.from_settings({name: dataset.config[name] for name in ("network", "spectra", "images")})
    signals = np.ones((3, renderer.network.symbols), np.complex64)
    for ask in (lambda: renderer.tile(signals), lambda: renderer.some(signals, [3])):
        with pytest.raises(InputError, match="made of range profiles, and a signal alone"):
            ask()
    assert renderer.some(signals, [0]).shape == (1, 32, 32)
    with pytest.raises(InputError, match="a signal holds one range cell"):
        spectrum("hrrp").fill(None, None, hrrp.DEFAULTS, (), None)


@pytest.mark.parametrize("cells", [4, 1, 2.5, True])
def test_cells_have_a_middle_and_neighbours(cells):
    with pytest.raises(InputError, match=r"cells is"):
        hrrp.Settings(1, 1, cells)


def test_profiles_ask_for_a_band_with_enough_cells(dataset):
    network = dataset.maker.network
    assert profile_cells(Spectra(hrrp=hrrp.Settings(1, 1, 511)), network) == 511 and not profile_cells(
        Spectra(), network
    )
    with pytest.raises(InputError, match="513, expected at most the 512"):
        profile_cells(Spectra(hrrp=hrrp.Settings(1, 1, 513)), network)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"effects": {"adc": {}}}, "effects is ..adc"), ({"shards": {"kind": "signal"}}, "shards.kind is 'signal'"),
        ({"network": {"stations": {"A": {}, "A-B": {"transmit": "A"}}}}, "links is ..A-B"),
    ],
)  # fmt: skip
def test_profiles_are_refused_where_no_stage_makes_them(dataset, change, words):
    refuse_profiles(dataset.config)
    with pytest.raises(InputError, match=words):
        refuse_profiles(dataset.config | change)
    refuse_profiles(without(dataset.config) | change)


def test_a_scene_with_effects_makes_no_profiles_on_the_spot(dataset):
    scene = Dataset(dataset.config | {"effects": {"adc": {}}}, dataset.clouds)
    with pytest.raises(InputError, match="range profiles together with effects"):
        scene.maker.profiles(scene.row(scene.place(0)), 3.0, np.ones((3, 400)))
