"""The price of accuracy down the chain: pixels that change, the time saved, the figure."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from chain import SPECTRA, WAVE
from craft import craft
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.measure.echo_cost import COLUMNS as MEASURED
from lowalt.measure.echo_pixels import changes, main, pixels, saved, signals
from lowalt.report.figures import cost_plots
from lowalt.report.figures.echo_cost import figure
from lowalt.report.figures.echo_cost import main as draw
from lowalt.report.page import rendered
from lowalt.report.sections.echo_cost import sentence, summary
from lowalt.targets.records import load_table
from lowalt.tiles.render import Renderer

TARGETS = Path(__file__).parents[1] / "config/targets.csv"
STATIONS = {"A": {"position_m": [0, 0, 25], "normal_deg": 0}, "B": {"position_m": [400, 0, 25], "normal_deg": 180}}
NETWORK = WAVE | {"stations": STATIONS}
IMAGES = {"size": 16, "scale": "decibel", "floor_db": 40.0, "gamma": 1.0, "colour_map": "viridis"}
BLOCK = {
    "motion": {
        "region": {"polygon_m": [[0, -300], [400, -300], [400, 300], [0, 300]], "mast_clearance_m": 10.0},
        "height_m": {"UAV": [30, 150]}, "tilt_deg": 20.0, "cadence": "free",
    },
    "seed": 1, "distances_m": [150.0], "tolerances": [0.3, 1e-9], "models": 2,
}  # fmt: skip
SETTINGS = {
    "network": NETWORK, "spectra": SPECTRA, "images": IMAGES, "motion": BLOCK["motion"], "seed": BLOCK["seed"],
    "cost": {key: BLOCK[key] for key in ("distances_m", "tolerances", "models")},
}  # fmt: skip


@pytest.fixture
def cloud():
    return craft()


PUBLISHED = {"vx_abs_max": 5, "vy_abs_max": 5, "vz_abs_max": 2, "freq_lo_hz": 60, "freq_hi_hz": 100}


def measured_row(**values) -> dict:
    """A row of the measured table, every column text as a CSV file gives it."""
    row = dict.fromkeys(MEASURED, "") | {"method": "engine", "category": "UAV", "subtype": "DJI Mini 2",
                                         "points": "20", "range_m": "150.0", "relative_error": "1e-5"}  # fmt: skip
    return row | values


def test_changes_counts_pixels_and_their_largest_step_both_ways():
    before = np.array([[0, 255], [7, 7]], np.uint8)
    after = np.array([[255, 0], [7, 8]], np.uint8)
    assert changes(before, before) == (0, 0)
    assert changes(before, after) == changes(after, before) == (3, 255)
    with pytest.raises(InputError, match=r"shapes \(2, 2\) and \(1, 2\)"):
        changes(before, after[:1])


def test_pixels_are_those_of_rendered_tiles_and_a_fine_tolerance_changes_none(cloud, monkeypatch):
    tiles = Renderer.from_settings({"network": NETWORK, "spectra": SPECTRA, "images": IMAGES})
    coarse, fine = pixels(tiles, [cloud], {"DJI Mini 2": PUBLISHED}, BLOCK)
    assert (coarse["tolerance"], fine["tolerance"]) == (0.3, 1e-9)
    assert coarse["pixels"] == fine["pixels"] == 2 * (2 * 16) * (3 * 16)
    assert (fine["changed_pixels"], fine["largest_step"]) == (0, 0)
    # A signal that is really off by its tolerance must be seen.
    rng = np.random.default_rng(0)

    def off(network, given, tolerance):
        signal = signals(network, given, None)
        noise = rng.normal(size=signal.shape) * abs(signal).max()
        return signal if tolerance is None else (signal + tolerance * noise).astype(np.complex64)

    monkeypatch.setattr("lowalt.measure.echo_pixels.signals", off)
    coarse, fine = pixels(tiles, [cloud], {"DJI Mini 2": PUBLISHED}, BLOCK)
    assert coarse["changed_share"] == coarse["changed_pixels"] / coarse["pixels"] > 0.3
    assert coarse["largest_step"] > 5 and fine["changed_share"] < 0.01


def test_motion_models_are_different_samples_whose_changes_add_up_and_whose_largest_step_counts(cloud, monkeypatch):
    asked, found = [], iter([(1, 9), (2, 4), (3, 5), (5, 6)])
    monkeypatch.setattr("lowalt.measure.echo_pixels.sample", lambda *given: asked.append(given[4:6]) or given)
    monkeypatch.setattr("lowalt.measure.echo_pixels.signals", lambda *given: None)
    monkeypatch.setattr("lowalt.measure.echo_pixels.changes", lambda *tiles: next(found))
    tiles = SimpleNamespace(network=None, tile=lambda signal: np.zeros((2, 3), np.uint8))
    block = {"distances_m": [30.0, 80.0], "tolerances": [1e-3], "models": 2, "motion": {}, "seed": 7}
    rows = pixels(tiles, [cloud], {"DJI Mini 2": PUBLISHED}, block)
    assert asked == [(7, 30.0), (8, 30.0), (7, 80.0), (8, 80.0)]
    told = [(row["changed_pixels"], row["pixels"], row["largest_step"], row["range_m"]) for row in rows]
    assert told == [(3, 12, 9, 30.0), (8, 12, 6, 80.0)]


def test_a_tolerance_below_the_floor_keeps_the_exact_signal(cloud):
    from lowalt.config.network import Network
    from lowalt.measure.echo_cost import sample

    network = Network.from_settings(NETWORK)
    given = sample(cloud, PUBLISHED, network, BLOCK["motion"], 1, 150.0, None)
    assert np.array_equal(signals(network, given, 1e-15), signals(network, given, None))
    with pytest.raises(InputError, match="tolerance is 2"):
        signals(network, given, 2)


def test_time_saved_is_taken_from_the_same_cloud_and_distance():
    table = [
        measured_row(tolerance="exact", seconds="4.0"), measured_row(tolerance="0.001", seconds="3.0"),
        measured_row(tolerance="exact", seconds="9.0", range_m="30.0"),
        measured_row(method="FINUFFT", tolerance="1e-09", seconds="1.0"),
    ]  # fmt: skip
    row = {"subtype": "DJI Mini 2", "points": 20, "range_m": 150.0, "tolerance": 1e-3}
    assert saved(table, row) == pytest.approx(0.25)
    assert saved(table, row | {"tolerance": 1e-9}) == saved(table, row | {"range_m": 30.0}) == ""
    assert saved(table, row | {"points": 400}) == ""


def test_the_command_writes_a_table_and_a_figure(cloud, tmp_path):
    from lowalt.targets.cloud import write

    write(tmp_path / "craft.npz", cloud)
    table = [
        measured_row(tolerance=name, seconds=time, points=str(len(cloud.points)))
        for name, time in (("exact", "2e-3"), ("0.3", "1e-3"))
    ]
    table.append(measured_row(method="FINUFFT", tolerance="1e-09", seconds="5e-2", points="400"))
    lines = [",".join(MEASURED), *(",".join(row[name] for name in MEASURED) for row in table)]
    (tmp_path / "cost.csv").write_text("\n".join(lines) + "\n")
    settings = json.dumps(SETTINGS | {"published": load_table(TARGETS)})
    arguments = ["--settings", settings, "--table", str(tmp_path / "cost.csv"), "--clouds", str(tmp_path / "craft.npz")]
    main([*arguments, "--out", str(tmp_path / "pixels.csv")])
    draw(["--table", str(tmp_path / "cost.csv"), "--pixels", str(tmp_path / "pixels.csv"), "--figure",
          str(tmp_path / "cost.png")])  # fmt: skip
    coarse, fine = read_csv(tmp_path / "pixels.csv", "tolerance", "changed_pixels", "time_saved")
    assert (coarse["time_saved"], fine["time_saved"], fine["changed_pixels"]) == ("0.5", "", "0")
    picture = (tmp_path / "cost.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    rows = [{**row, "range_m": "150.0", "changed_share": "0.5"} for row in (coarse, fine)]
    panels = figure(table, rows).axes
    named = ["measured error / largest value"] * 2 + ["tolerance asked for"]
    assert [panel.get_xlabel() for panel in panels] == named
    titles = [f"UAV, {len(cloud.points)} points", "UAV, 400 points", ""]
    assert [panel.get_title() for panel in panels] == titles
    # One point a measurement, and the engine's curve at the one distance.
    assert [len(panel.lines) for panel in panels[:2]] == [1 + 2, 1 + 1]


def test_the_summary_compares_where_all_methods_were_timed():
    shown = {"hardware": "one core"}
    table = [
        measured_row(tolerance="exact", seconds="2e-3", relative_error="1e-13", **shown),
        measured_row(tolerance="exact", seconds="4e-3", relative_error="3e-13", points="400", **shown),
        measured_row(tolerance="exact", seconds="9.0", relative_error="5e-12", range_m="30.0", **shown),
        measured_row(tolerance="0.001", seconds="1e-3", relative_error="1e-5", **shown),
        measured_row(tolerance="0.001", seconds="9.0", relative_error="1e-6", range_m="30.0", **shown),
        measured_row(method="FINUFFT", tolerance="1e-09", seconds="0.3", relative_error="1e-10", **shown),
    ]  # fmt: skip
    changed = [{"tolerance": "0.001", "pixels": "100", "changed_pixels": "2"}] * 3
    found = summary(table, changed)
    assert (found["range_m"], found["samples"], found["hardware"]) == (150.0, 2, "one core")
    exact, loose, peer = found["rows"]
    assert exact["seconds"] == pytest.approx(3e-3) and exact["over_finufft"] == pytest.approx(100)
    assert (exact["error"], exact["pixels"], exact["over_direct"]) == (5e-12, None, None)
    assert loose["pixels"] == [6, 300] and loose["error"] == 1e-5 and peer["over_finufft"] == 1
    said = sentence(found["rows"])
    text = rendered("echo_cost", {"own": True, "cost": found, "plot": cost_plots.echo(table), "sentence": said})
    assert said.startswith("The exact mode costs 3.00 ms a signal; ") and said in text
    assert "6 of 300" in text and "<td>3.00</td>" in text and "mean over 2 samples at 150 m" in text
