"""What the cost tables of `lowalt.measure` hold: methods, clocks and samples are made up, so all follows by hand."""

import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from craft import NETWORK, craft
from lowalt.config.layers import load
from lowalt.config.network import Network
from lowalt.files.errors import BelowFloor
from lowalt.measure import echo_cost, scale
from lowalt.recognition.schemes import named

PUBLISHED = {"vx_abs_max": 5, "vy_abs_max": 5, "vz_abs_max": 2, "freq_lo_hz": 60, "freq_hi_hz": 100}
MOTION = {
    "region": {"polygon_m": [[0, -400], [400, -400], [400, 400], [0, 400]], "mast_clearance_m": 10.0},
    "height_m": {"UAV": [30, 150]}, "tilt_deg": 20.0, "cadence": "free",
}  # fmt: skip


def network(height_m=25.0):
    """The craft's network, its first station at a place of its own."""
    settings = copy.deepcopy(NETWORK)
    first = settings["stations"][next(iter(settings["stations"]))]
    first["position_m"], first["normal_deg"] = [30.0, -20.0, height_m], 40.0
    return Network.from_settings(settings)


@pytest.mark.parametrize("height_m", [25.0, 500.0])
def test_a_sample_starts_at_its_distance_in_front_of_the_first_station_and_never_steeper_than_nine_tenths(height_m):
    """Craft fly at 30 to 150 m: 20 m away they are too high for a mast of 25 m, and too low for one of 500 m."""
    radar, turns = network(height_m), []
    station = radar.stations[0]
    for seed in range(60):
        _, _, aim = echo_cost.sample(craft(), PUBLISHED, radar, MOTION, seed, 20.0, None)
        way = aim - station.position_m
        assert np.linalg.norm(way) == pytest.approx(20.0) and abs(way[2]) <= 18.0 + 1e-9
        turns.append(np.arctan2(way[1], way[0]) - station.normal_rad)
        if height_m == 500.0:
            assert way[2] == pytest.approx(-18.0)
    assert -0.8 <= min(turns) < -0.6 and 0.6 < max(turns) <= 0.8


def test_a_sample_s_points_stand_by_part_with_their_own_cross_sections():
    cloud = craft()
    order = np.random.default_rng(2).permutation(len(cloud.points))
    mixed = replace(cloud, points=cloud.points[order], part=cloud.part[order], rcs_m2=1.0 + np.arange(len(order)))
    own = {tuple(point): rcs for point, rcs in zip(mixed.points.tolist(), mixed.rcs_m2, strict=True)}
    for count in (None, 7, 400):
        moved, rcs, aim = echo_cost.sample(mixed, PUBLISHED, network(), MOTION, 1, 150.0, count)
        assert len(rcs) == len(moved.points) == (count or len(order)) and (np.diff(moved.part) >= 0).all()
        assert [own[tuple(point)] for point in moved.points.tolist()] == rcs.tolist()
        assert count is not None or len(set(rcs.tolist())) == len(order)
        again = echo_cost.sample(mixed, PUBLISHED, network(), MOTION, 1, 150.0, count)
        assert (again[1] == rcs).all() and (again[2] == aim).all()
    starts = [echo_cost.sample(mixed, PUBLISHED, network(), MOTION, 1, 150.0, count)[2] for count in (None, 7)]
    assert (starts[0] != starts[1]).any()


def test_eight_symbols_and_the_two_deepest_fades_are_judged(monkeypatch):
    monkeypatch.setattr(echo_cost.echo_baselines, "judge", lambda *given: np.array([given[-1]]))
    signal = np.linspace(3, 9, 400) * 1j
    signal[[17, 311]] = 0.1, 0.2
    judged = [echo_cost.truths(None, None, (), signal, seed) for seed in (1, 2)]
    for found in judged:
        assert {17, 311} <= set(found) and 9 <= len(found) <= 10
        assert all(cells.tolist() == [n] for n, cells in found.items())
    assert set(judged[0]) != set(judged[1])
    assert set(echo_cost.truths(None, None, (), np.ones(3), 1)) == {0, 1, 2}


def test_an_error_is_the_largest_at_a_judged_symbol_over_the_largest_signal():
    signal = np.array([1.0, 4j, -8.0, 2.0])
    truth = {0: np.array([0.2, 1.5]), 1: np.array([4j, 9j, 0.0]), 3: np.array([-2.0, 0.1])}
    assert echo_cost.error(signal, truth) == 5 / 8
    assert echo_cost.error(signal, {0: np.array([1.0])}) == 0


@pytest.mark.parametrize("direct", [0, 3])
def test_rows_of_a_sample_have_every_method_in_its_own_rounds_and_ratios_of_the_same_run(direct, monkeypatch):
    def engine(radar, station, *given):
        if given[-1] == 1e-9:
            raise BelowFloor("too fine")
        return SimpleNamespace(signal=np.array([1.0]), bound=0.25)

    monkeypatch.setattr(echo_cost, "echo_signal", engine)
    for name in ("closed", "finufft", "direct", "factored"):
        monkeypatch.setattr(echo_cost.echo_baselines, name, lambda *given, name=name: name)
    monkeypatch.setattr(echo_cost, "truths", lambda *given: "truth")
    monkeypatch.setattr(echo_cost, "error", lambda signal, truth: signal if isinstance(signal, str) else 0.125)
    asked = []

    def in_turn(calls):
        asked.extend(calls)
        return [(float(2**number), call()) for number, (call, _, _) in enumerate(calls)]

    monkeypatch.setattr(echo_cost, "in_turn", in_turn)
    block = {"repeats": 5, "direct_repeats": direct, "tolerances": [1e-3, 1e-9]}
    given = (None, np.ones(4), None)
    rows = echo_cost.rows_of(network(), SimpleNamespace(category="UAV", subtype="x"), given, 30.0, 1, block)
    slow = ["direct sum, numpy", "factored sum, numpy"] if direct else []
    assert [row["method"] for row in rows] == ["closed form, numpy", "FINUFFT", *slow, "engine", "engine"]
    assert [row["tolerance"] for row in rows] == ["", 1e-9, *[""] * len(slow), "exact", 1e-3]
    rounds = [(5, 1), (5, 1), *([(3, 1), (5, 1)] if direct else []), (5, 8), (5, 8)]
    assert [(repeats, calls) for _, repeats, calls in asked] == rounds
    seconds = [row["seconds"] for row in rows]
    assert seconds == [2.0**number for number in range(len(rows))]
    assert [row["ratio_to_finufft"] for row in rows] == [2 / one for one in seconds]
    assert [row["ratio_to_direct"] for row in rows] == [4 / one if direct else "" for one in seconds]
    assert [row["proved_bound"] for row in rows[-3:]] == ["", 0.25, 0.25]
    assert {row["points"] for row in rows} == {4} and rows[-1]["relative_error"] == 0.125


def test_every_cloud_distance_and_number_of_points_is_measured_and_the_direct_sum_at_its_distances(monkeypatch):
    asked = []
    monkeypatch.setattr(echo_cost, "sample", lambda *given: (None, np.ones(given[-1] or 77), given[-2:]))
    monkeypatch.setattr(
        echo_cost, "rows_of", lambda *given: asked.append((given[3], len(given[2][1]), given[-1])) or [1]
    )
    block = {"distances_m": [30.0, 150.0], "points": [0, 40], "direct_distances_m": [150.0], "direct_repeats": 3,
             "motion": {}, "seed": 1}  # fmt: skip
    rows = echo_cost.measure(None, [SimpleNamespace(subtype="x")] * 2, {"x": {}}, block)
    assert rows == [1] * 8
    assert [(one, count, given["direct_repeats"]) for one, count, given in asked] == [
        (30.0, 77, 0), (30.0, 40, 0), (150.0, 77, 3), (150.0, 40, 3)] * 2  # fmt: skip


def test_an_estimate_adds_stages_rounds_hours_and_gigabytes_and_counts_a_recipe_s_one_signal():
    config = load(["config/default.yaml"], "workflow/schemas/config.schema.yaml")
    models, samples = scale.samples_of(config)
    assert samples == 6 * models
    stages = [{"rule": rule, "wall_s": "1234.567", "samples": "1000", "sample_bytes": "260123", "hardware": "here"}
              for rule in scale.DATA_RULES]  # fmt: skip
    signal = 8 * 400 * 3
    for kind, size in (("image", 260123), ("signal", signal), ("recipe", signal / 6)):
        row = scale.estimate(stages, [], config | {"shards": {"kind": kind}}, "x")
        assert row["core_hours"] == round(6 * 1.234567 * samples / 3600, 2)
        assert row["shards_gb"] == round(size * samples / 1e9, 1)
        assert row["noisy_gb"] == round(signal * samples / 1e9, 1) and row["training_core_hours"] == ""


def test_a_network_counts_by_its_row_of_most_images_and_settings_by_the_scheme_s_own():
    config = load(["config/default.yaml"], "workflow/schemas/config.schema.yaml")
    block = config["recognition"]
    block |= {"schemes": ["A:VRP+TRP+VT", "ABC:VRP+TRP+VT"], "seeds": [1, 2], "protocols": ["unseen"]}
    kept = {"backbone": block["network"]["backbone"], "pixels": str(block["size"]), "hardware": "best"}
    costs = [
        kept | {"network_bytes": str(9 * block["size"] ** 2), "train_ms": "1.5"},
        kept | {"network_bytes": str(3 * block["size"] ** 2), "train_ms": "7", "hardware": "few"},
        kept | {"network_bytes": str(9 * block["size"] ** 2), "train_ms": "8", "hardware": "later"},
        kept | {"network_bytes": str(12 * block["size"] ** 2), "train_ms": "", "hardware": "untimed"},
        {"backbone": "svm", "pixels": "", "network_bytes": "1", "train_ms": "", "hardware": "none"},
    ]
    number, hours, hardware = scale.training_hours(costs, config)
    visits = 2 * block["training"]["steps"] * block["training"]["batch"]
    assert (number, hardware) == (4, "best")
    assert hours == pytest.approx(visits * 1.5e-3 / 3600 * (9 + 3) / 9)
    assert named(block["table"], "A:VRP+TRP+VT", "ABC").size == 0
    assert scale.training_hours([], config) == (4, None, "")
    # A network that was timed on fewer images than another tells nothing of what more of them take.
    wider = costs[0] | {"backbone": "another"}
    assert scale.training_hours([costs[1], wider], config) == (4, None, "")
    assert scale.training_hours([costs[0], wider], config) == (4, hours, "best")
