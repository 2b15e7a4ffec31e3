"""Built-in models with other settings: counts of points, coaxial rotors, rolling wheels, wing beats."""

import pytest

from builtin_records import NAMES, RECORDS, TABLE, WRITTEN
from lowalt.common.errors import InputError
from lowalt.targets.assemble import allot
from lowalt.targets.builtin import builtin_cloud
from lowalt.targets.builtin_record import MODULES
from lowalt.targets.records import merge
from lowalt.targets.uav_pieces import hubs, motor_diagonal


def variant(name, **changes):
    """The cloud of a record with some keys changed as a user's file would."""
    return builtin_cloud(merge(TABLE[name], WRITTEN[name] | changes, name), 1)


def test_allotment_gives_moving_parts_their_share_in_whole_blades():
    for name in NAMES:
        record = RECORDS[name]
        parts, _ = MODULES[record["category"]].parts(record)
        counts = allot(parts, record["points"], record["moving_share"])
        assert sum(counts) == record["points"]
        moving = sum(count for part, count in zip(parts, counts, strict=True) if part.kind != "body")
        blades = sum(part.copies for part in parts if part.kind != "body")
        assert abs(moving - record["moving_share"] * record["points"]) <= blades / 2 + 4
        assert all(count % part.copies == 0 and count >= part.copies for part, count in zip(parts, counts, strict=True))


def test_a_count_that_leaves_no_body_is_refused():
    parts, _ = MODULES["UAV"].parts(RECORDS["DJI Mini 2"])
    with pytest.raises(InputError, match="15 points for 5 parts leave none for the body"):
        allot(parts, 15, 0.99)
    assert allot(parts, 9, 0.4) == [1, 2, 2, 2, 2]


@pytest.mark.parametrize("points", [20, 1000])
def test_any_sensible_count_is_met(points):
    for name in ("DJI Mini 2", "Wild goose", "Audi A6L 2019"):
        assert len(variant(name, points=points).points) == points


def test_the_eh216_may_fly_sixteen_rotors_in_coaxial_pairs():
    cloud = variant("EH 216 S", coaxial=True)
    rotors = cloud.parts_of("rotor")
    assert len(rotors) == 16 and len(cloud.points) == 396
    for upper, lower in zip(rotors[::2], rotors[1::2], strict=True):
        apart = cloud.hinges[upper] - cloud.hinges[lower]
        assert apart[2] > 0.3 and abs(apart[:2]).max() < 1e-12
        assert cloud.axes[upper] @ cloud.axes[lower] == -1
    assert 2 * motor_diagonal(RECORDS["EH 216 S"]) > 5
    assert len(hubs(RECORDS["EH 216 S"], None)) == 8


def test_wheels_may_have_their_rolling_diameter():
    cloud = variant("Xiaomi SU7 2024", wheel_size="rolling")
    assert cloud.record["wheel_diameter_m"] == 0.703
    for wheel in cloud.parts_of("wheel"):
        assert cloud.points[cloud.part == wheel][:, 2].min() == pytest.approx(-0.7, abs=1e-5)


def test_flap_and_cross_section_may_be_set():
    cloud = variant("Crow", flap={"mean_deg": 5.0}, rcs_m2_per_point=0.01)
    assert cloud.record["flap"]["mean_deg"] == 5.0 and cloud.record["flap"]["amplitude_deg"] == 40.0
    assert (cloud.rcs_m2 == 0.01).all()
