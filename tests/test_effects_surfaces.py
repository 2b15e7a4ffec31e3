"""Surfaces that hide points: whose they are, where they come from, and how much a blade lets pass."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid

from lowalt.common.config import canonical, load_yaml
from lowalt.common.errors import InputError
from lowalt.effects.channel import occlusion
from lowalt.effects.view import View
from lowalt.motion.table import NUMBERS
from lowalt.targets import occluders
from lowalt.targets.make import make
from lowalt.targets.records import load_records
from lowalt.targets.surfaces import ellipsoid
from real_inputs import FOLDER, needs_inputs
from test_effects_occlusion import NETWORK, built, cast


def test_strength_scales_and_a_target_without_its_surfaces_is_refused(tmp_path):
    view, _ = built("DJI Mini 2")
    hidden = occlusion.hidden(view)
    assert (occlusion.visible({"strength": 1.0, "blades": "opaque"}, view) == ~hidden).all()
    assert abs(occlusion.visible({**occlusion.DEFAULTS, "strength": 1e-9}, view) - 1).max() < 1e-8
    assert occlusion.idle({"strength": 0.0})
    with pytest.raises(
        InputError, match=r"DJI Mini 2 has no surfaces, make them with python -m lowalt\.targets\.occluders"
    ):
        occlusion.hidden(replace(view, occluders=None))
    with pytest.raises(InputError, match="surfaces of Crow"):
        occlusion.hidden(replace(view, occluders={**view.occluders, "subtype": "Crow"}))
    path = tmp_path / "surfaces.npz"
    occluders.write(path, view.occluders, "DJI Mini 2")
    back = occluders.read(path)
    assert (occlusion.hidden(replace(view, occluders=back)) == hidden).all()
    first = path.read_bytes()
    occluders.write(path, back, "DJI Mini 2")
    assert path.read_bytes() == first
    path.write_bytes(first[:500])
    with pytest.raises(InputError, match="not a surfaces file"):
        occluders.read(path)


def test_surfaces_are_known_by_their_own_subtype(tmp_path):
    sphere = occluders.from_surfaces([ellipsoid((1, 1, 1))], np.zeros(1), np.ones(1, bool))
    for name in ("b", "a"):
        occluders.write(tmp_path / f"{name}.npz", sphere, f"subtype {name}")
    found = occluders.read_all([tmp_path / "b.npz", tmp_path / "a.npz"])
    assert list(found) == ["subtype b", "subtype a"] and found["subtype a"]["subtype"] == "subtype a"


def test_the_command_takes_the_folder_of_inputs_from_the_environment(tmp_path, monkeypatch):
    record = {"subtype": "DJI Mini 2", "source": "mesh"}
    call = ["--settings", canonical({"seed": 1, "record": record}), "--out", str(tmp_path / "out.npz")]
    seen = []
    monkeypatch.setattr(occluders, "make", lambda record, inputs, seed: seen.append(inputs) or {})
    monkeypatch.setattr(occluders, "write", lambda *given: None)
    monkeypatch.delenv("LOWALT_INPUTS", raising=False)
    occluders.main(call)
    monkeypatch.setenv("LOWALT_INPUTS", "/meshes")
    occluders.main(call)
    occluders.main([*call, "--inputs", "/others"])
    assert seen == [None, Path("/meshes"), Path("/others")]


@needs_inputs
@pytest.mark.parametrize("name", ["DJI Mini 2", "NIO ET5T 2023"])
def test_the_surfaces_of_a_users_mesh_lie_where_its_cloud_does(name):
    config = load_yaml("config/default.yaml")
    records = [*config["targets"]["records"], "config/targets/real.yaml"]
    record = load_records(config["targets"]["table"], records)[name]
    cloud = make(record, FOLDER, 1)
    given = occluders.make(record, FOLDER, 1) | {"subtype": name}
    size = np.ptp(cloud.points, axis=0).max()
    for part in range(len(cloud.kinds)):
        mine = given["vertices"][given["vertex_part"] == part]
        points = cloud.points[cloud.part == part]
        assert (points.min(axis=0) > mine.min(axis=0) - 0.02 * size).all()
        assert (points.max(axis=0) < mine.max(axis=0) + 0.02 * size).all()
    assert np.quantile(given["offset_m"], 0.9) < 0.005 * size
    assert len(given["faces"]) < 10_000
    row = {"subtype": name, "model": 0, **dict.fromkeys(NUMBERS, 0.4), "x_m": 150.0, "y_m": 100.0, "z_m": 60.0}
    view = View(NETWORK, NETWORK.station("A"), cloud, row, NETWORK.times_s, occluders=given)
    found = occlusion.hidden(view)
    assert (found[200] == cast(view, 200)).all()
    assert 0.2 < found.mean() < 0.8


@pytest.mark.parametrize("name, widest", [("DJI Mini 2", 0.03), ("EH 216 S", 0.5)])
def test_blades_hide_by_their_width_over_the_wavelength(name, widest):
    view, _ = built(name)
    blades = occlusion.blades_m(view.cloud, view.occluders)
    assert set(blades) == set(view.cloud.parts_of("rotor"))
    widths, radii = np.array(list(blades.values())).T
    assert widths.min() > 0.003 and widths.max() < widest and (radii > 2 * widths).all()
    share = occlusion.through_blades(view)
    assert (share > 0.7) == (name == "DJI Mini 2") and 0.01 < share < 0.97
    whole, rest, behind = (occlusion.hidden(view, by) for by in ("all", "rest", "blades"))
    assert (whole == (rest | behind)).all() and (behind & ~rest).any()
    factor = occlusion.visible({"strength": 1.0, "blades": "bent"}, view)
    assert (factor[rest] == 0).all() and (factor[~whole] == 1).all()
    assert factor[behind & ~rest] == pytest.approx(share)
    assert (occlusion.visible({"strength": 1.0, "blades": "transparent"}, view) == ~rest).all()
    # Toward short waves blades become opaque, toward long ones nothing.
    for carrier, low, high in ((4.9e13, 0.0, 1e-2), (4.9e6, 0.98, 1.0)):
        assert low <= occlusion.through_blades(replace(view, network=replace(NETWORK, carrier_hz=carrier))) <= high


@pytest.mark.parametrize("width", [0.002, 0.011, 0.06, 0.3])
def test_what_passes_a_strip_is_the_rest_of_the_fresnel_integral(width):
    distance, wave = 0.12, 0.061
    x = np.linspace(-0.5 * width, 0.5 * width, 20_001)
    slit = np.sqrt(1j / (wave * distance)) * trapezoid(np.exp(-1j * np.pi * x**2 / (wave * distance)), x)
    assert occlusion.passed(width, distance, wave) == pytest.approx(abs(1 - slit) ** 2, rel=1e-6)
