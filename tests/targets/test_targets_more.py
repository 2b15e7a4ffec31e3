"""Targets beyond the published forty: their records alone add them.

They move as their kind does.
"""

import hashlib
from pathlib import Path

import numpy as np
import pytest
import yaml

from lowalt.config.layers import load
from lowalt.files.atomic import slug
from lowalt.files.errors import InputError
from lowalt.motion import positions
from lowalt.motion.drawing import draw
from lowalt.numerics import portable
from lowalt.numerics.streams import stream
from lowalt.targets import cyclist, quadruped
from lowalt.targets.cloud import write
from lowalt.targets.gallery import bones
from lowalt.targets.make import make
from lowalt.targets.records import estimates, load_records, records_of
from lowalt.targets.skeleton import circle, joint
from moving_clouds import SETTINGS, row
from tables import rows

ROOT = Path(__file__).parents[2]
LAYERS = [ROOT / "config/default.yaml", ROOT / "config/more.yaml"]
CONFIG = load(LAYERS, ROOT / "workflow/schemas/config.schema.yaml")
RECORDS = records_of(CONFIG["targets"])
LEGS = ("left fore", "right hind", "right fore", "left hind")
MORE = list(RECORDS)[40:]


@pytest.fixture(scope="module")
def clouds():
    return {name: make(RECORDS[name], None, 1) for name in MORE}


def test_each_is_as_large_as_its_row_says_and_the_forty_stay_as_they_are(clouds):
    plain = CONFIG["targets"]
    assert load_records(plain["table"], plain["records"]) == {
        name: RECORDS[name] for name in list(RECORDS)[:40]
    }
    assert len(MORE) == 10
    for name, extent in {
        "Cessna 172S": (11.0, 8.28),
        "JOUAV CW-15": (3.54,),
        "City bus": (2.55, 11.95, 3.076),
        "Weather balloon": (1.8, 1.8),
        "Agusta A109A": (10.97,),
    }.items():
        assert np.ptp(clouds[name].points, axis=0)[: len(extent)] == pytest.approx(extent, rel=0.01)
    rotor = clouds["MD 520N"]
    blades = rotor.points[rotor.part == 1]
    assert portable.norm(blades[:, :2] - rotor.hinges[1, :2]).max() == pytest.approx(
        8.33 / 2, rel=0.01
    )
    turns = np.unique(np.round(np.degrees(np.arctan2(blades[:, 1], blades[:, 0])) / 72) % 5)
    assert len(turns) == 5 and len(blades) % 5 == 0
    hexacopter = clouds["Yuneec H520"]
    assert hexacopter.kinds.count("rotor") == 6
    assert np.allclose(portable.norm(hexacopter.hinges[1:, :2]), 0.52 / 2)
    tail = clouds["Agusta A109A"]
    assert np.allclose(tail.hinges[1] - tail.hinges[2], [0.33, 6.57, 0.72]) and np.allclose(
        tail.axes[2], [1, 0, 0]
    )
    counts = tail.record["points_by_part"]
    # Points go by the area of the blades: 4 x 10.97 x 0.335 and 2 x 1.89 x 0.199.
    assert counts["main rotor"] / counts["tail rotor"] == pytest.approx(14.70 / 0.75, rel=0.3)


def test_clouds_are_the_kept_ones_to_the_byte(tmp_path, clouds):
    """Each length, angle and count of the ten models.

    Where a change is wanted, the sums found here are kept.
    """
    for name, cloud in clouds.items():
        write(tmp_path / f"{slug(name)}.npz", cloud)
    found = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in tmp_path.iterdir()
    }
    kept = (ROOT / "tests/data/more_clouds.sha256").read_text()
    assert "".join(f"{found[name]}  {name}\n" for name in sorted(found)) == kept


def phases(cloud, rate_hz):
    """A row of a target at rest whose parts turn at `rate_hz`."""
    turning = {f"phase_{index}_rad": 0.4 * index for index in range(len(cloud.parts_of("rotor")))}
    return row(rate_hz=rate_hz, **turning)


def test_a_tail_rotor_lift_propellers_and_a_plane_s_propeller_turn_in_their_planes(clouds):
    for name in ("Agusta A109A", "JOUAV CW-15 in transition"):
        assert clouds[name].record["rate_factors"] == RECORDS[name]["rate_factors"]
    cloud = clouds["JOUAV CW-15 in transition"]
    lifting = [
        cloud.axes[cloud.names.index(f"lift {place}")][2]
        for place in ("front left", "front right", "rear left", "rear right")
    ]
    assert lifting == [-1, 1, 1, -1]
    # A plane's propeller turns in a plane across its way.
    plane = clouds["Cessna 172S"]
    now, quarter = (
        positions(plane, phases(plane, 40.0), np.array([0.0, 1 / 160]))[:, plane.part == 1]
        - plane.hinges[1]
    )
    assert np.allclose(now[:, 1], quarter[:, 1], atol=1e-9)
    assert np.allclose(
        now[:, 0], quarter[:, 2] * np.sign((now[:, 0] * quarter[:, 2]).sum()), atol=1e-9
    )


def test_every_cell_and_figure_without_a_source_is_called_an_estimate():
    cyclist_of_a_row = RECORDS["Road cyclist"]
    mini = RECORDS["DJI Mini 2"]
    assert estimates(cyclist_of_a_row) == (3, 3)
    assert estimates(cyclist_of_a_row | {"row_from": {"hgt_m": "measured"}}) == (2, 3)
    marked = [entry["source"] for entry in mini["figures"].values()]
    assert estimates(mini) == (marked.count("estimate"), len(marked))


def drawn(cloud, name, cadence="free", seed=1):
    heights = {"height_m": CONFIG["motion"]["height_m"], "region": {"mast_clearance_m": 0}}
    settings = SETTINGS | heights | {"cadence": cadence}
    corners = np.array([[0.0, 0], [100, 0], [0, 100]])
    return draw(
        stream(seed, "draw"), cloud, RECORDS[name]["published"], np.zeros((1, 2)), corners, settings
    )


def test_motion_is_drawn_for_all_of_them_and_wheels_follow_the_road(clouds):
    rows = {name: drawn(cloud, name) for name, cloud in clouds.items()}
    assert 60 <= rows["Cessna 172S"]["z_m"] <= 300 and 30 <= rows["Weather balloon"]["z_m"] <= 500
    assert (
        np.isnan(rows["Weather balloon"]["rate_hz"]) and 35 <= rows["Cessna 172S"]["rate_hz"] <= 45
    )
    for name, cloud in clouds.items():
        assert np.isfinite(positions(cloud, rows[name] | {"model": 0}, np.linspace(0, 1, 5))).all()
    bus = rows["City bus"]
    assert bus["rate_hz"] == pytest.approx(
        np.hypot(bus["vx_mps"], bus["vy_mps"]) / (np.pi * 0.9565)
    )
    # The walker keeps its pace under `free`, the bicycle's wheels cannot.
    speed = np.hypot(rows["Road cyclist"]["vx_mps"], rows["Road cyclist"]["vy_mps"])
    assert (
        rows["Road cyclist"]["playback"] == pytest.approx(speed / 6.0)
        and rows["Labrador"]["playback"] == 1
    )


def test_a_rolling_wheel_touches_the_ground_without_slip():
    frames = 4800
    track, names, ahead = cyclist.cycle_m(1.78, frames)
    assert ahead == pytest.approx(3 * np.pi * 0.678)
    rim = track[:, names.index("rear rim 1")]
    velocity = (np.roll(rim, -1, 0) - np.roll(rim, 1, 0)) * frames / 2 + [0, ahead, 0]
    low = rim[:, 2].argmin()
    assert rim[low, 2] == pytest.approx(0, abs=1e-6)
    assert np.abs(velocity[low]).max() < 0.01 * ahead
    assert velocity[rim[:, 2].argmax(), 1] == pytest.approx(2 * ahead, rel=1e-4)


def test_bones_keep_their_lengths_and_cycles_close(clouds):
    for name, pairs in {
        "Road cyclist": [("hip", "knee", 0.245 * 1.78), ("knee", "ankle", 0.285 * 1.78)],
        "Labrador": [
            ("fore shoulder", "fore elbow", 0.36 * 0.57),
            ("hind knee", "hind hock", 0.44 * 0.57),
        ],
    }.items():
        cloud = clouds[name]
        for one, other, length in pairs:
            for side in ("left", "right"):
                ends = [
                    cloud.track[:, cloud.names.index(f"{side} {word}")] for word in (one, other)
                ]
                flat = (ends[0] - ends[1])[:, 1:]
                assert np.allclose(np.sqrt((flat**2).sum(1)), length, rtol=1e-9)
        steps = portable.norm(np.diff(np.concatenate([cloud.track, cloud.track[:1]]), axis=0))
        assert steps[-1].max() <= 1.05 * steps[:-1].max()
        assert bones(cloud.names)


def test_a_dog_trots_with_diagonal_legs_together_and_still_feet():
    height = 0.57
    mass = 30
    speed = 2.2
    track, names, duration, stride = quadruped.cycle_m(height, mass, speed, 1000)
    assert stride == pytest.approx(speed * duration)
    paws = {name: track[:, names.index(f"{name} paw")] for name in LEGS}
    lift = {name: paw[:, 2] - paw[:, 2].min() for name, paw in paws.items()}
    assert np.allclose(lift["left fore"], lift["right hind"]) and np.allclose(
        lift["right fore"], lift["left hind"]
    )
    assert np.allclose(lift["left fore"], np.roll(lift["right fore"], 500))
    down = lift["left fore"] == 0
    assert down.mean() == pytest.approx(quadruped.STANCE, abs=0.003)
    moves = np.diff(paws["left fore"][:, 1]) * 1000 / duration + speed
    assert np.abs(moves[down[1:] & down[:-1]]).max() < 1e-9
    fastest = 5.5 * mass**0.24 / 3.6
    assert quadruped.stride_hz(mass, fastest) == pytest.approx(269 / 60 * mass**-0.14)
    with pytest.raises(InputError, match=r"quadruped of 0.2 m at 3.0 m/s: limb: ends are"):
        quadruped.cycle_m(0.2, 30, 3.0, 8)


def test_a_joint_lies_at_both_lengths_on_the_side_asked_for():
    ends = np.array([[0.0, 0.1, 0.0], [0.0, -0.3, 0.2]])
    start = np.array([[0.0, 0.0, 1.0]] * 2)
    for bend in (1, -1):
        found = joint(start, ends, 0.6, 0.7, bend)
        assert np.allclose(portable.norm(found - start), 0.6) and np.allclose(
            portable.norm(found - ends), 0.7
        )
        assert (np.sign(found[:, 1] - (start + ends)[:, 1] / 2) == bend).all()
    with pytest.raises(InputError, match=r"expected what bones of 0\.3 and 0\.3 m reach"):
        joint(start, ends, 0.3, 0.3, 1)
    assert np.allclose(circle(np.array([0.0, 0.25]), 2.0), [[0, 0, 2], [0, 2, 0]])


@pytest.mark.parametrize(
    ("name", "change", "message"),
    rows("more_records", "records"),
)
def test_records_that_make_no_such_target_are_refused(tmp_path, name, change, message):
    record = yaml.safe_load((ROOT / "config/targets/more.yaml").read_text())[name]
    record["row"] |= change.get("row", {})
    (tmp_path / "wrong.yaml").write_text(
        yaml.safe_dump({name: record | {**change, "row": record["row"]}})
    )
    with pytest.raises(InputError, match=message):
        records_of({**CONFIG["targets"], "own": {"wrong": str(tmp_path / "wrong.yaml")}})
