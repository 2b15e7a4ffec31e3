"""Built-in models with other settings: counts of points, coaxial rotors, rolling wheels, wing beats."""

import numpy as np
import pytest

from builtin_records import NAMES, RECORDS, TABLE, WRITTEN
from lowalt.files.errors import InputError
from lowalt.targets.assemble import allot
from lowalt.targets.builtin import MODULES, builtin_cloud
from lowalt.targets.records import merge


def variant(name, **changes):
    """The cloud of a record with some keys changed as a user's file would."""
    return builtin_cloud(merge(TABLE[name], WRITTEN[name] | changes, name), 1)


def test_allotment_gives_moving_parts_their_share_in_whole_blades():
    for name in NAMES:
        record = RECORDS[name]
        parts, _ = MODULES[record["category"]].parts(record)
        counts = allot(parts, record["points"], record["moving_share"], name)
        assert sum(counts) == record["points"]
        moving = sum(count for part, count in zip(parts, counts, strict=True) if part.kind != "body")
        blades = sum(part.copies for part in parts if part.kind != "body")
        assert abs(moving - record["moving_share"] * record["points"]) <= blades / 2 + 4
        assert all(count % part.copies == 0 and count >= part.copies for part, count in zip(parts, counts, strict=True))


def test_a_count_that_leaves_no_body_is_refused():
    parts, _ = MODULES["UAV"].parts(RECORDS["DJI Mini 2"])
    with pytest.raises(InputError, match="mini: 15 points for 5 parts leave none for the body"):
        allot(parts, 15, 0.99, "mini")
    assert allot(parts, 9, 0.4, "mini") == [1, 2, 2, 2, 2]


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
        assert apart == pytest.approx([0, 0, 1.29], abs=1e-12)
        assert cloud.axes[upper] @ cloud.axes[lower] == -1


@pytest.mark.parametrize(
    ("name", "turn"), [("EH 216 S", 0.25), ("Type-A Firefighting UAV", 0), ("Type-B Firefighting UAV", 1 / 6)]
)
def test_a_rotor_of_two_layers_turns_as_one_with_its_lower_blades_ahead(name, turn):
    cloud, figures = variant(name, points=3000), RECORDS[name]["figures"]
    for rotor in cloud.parts_of("rotor"):
        points = cloud.points[cloud.part == rotor] - cloud.hinges[rotor]
        gap = figures["layer_gap"]["si"]
        upper, lower = (points[abs(points[:, 2] + depth) < gap / 2] for depth in (0, gap))
        assert len(upper) + len(lower) == len(points) and abs(len(upper) - len(lower)) < 0.2 * len(points)
        # The sums of (x + i y)^n over n equal blades have n times the angle of a blade.
        count = figures["blade_count"]["value"]
        told = [np.angle(((layer[:, 0] + 1j * layer[:, 1]) ** count).sum()) for layer in (upper, lower)]
        off = (told[1] - told[0]) / count / (2 * np.pi) - turn
        assert abs(off * count - round(off * count)) < 0.05 * count


def test_wheels_may_have_their_rolling_diameter():
    cloud = variant("Xiaomi SU7 2024", wheel_size="rolling")
    assert cloud.record["wheel_diameter_m"] == 0.703
    for wheel in cloud.parts_of("wheel"):
        assert cloud.points[cloud.part == wheel][:, 2].min() == pytest.approx(-0.7, abs=1e-5)


def test_flap_and_cross_section_may_be_set():
    cloud = variant("Crow", flap={"mean_deg": 5.0}, rcs_m2_per_point=0.01)
    assert cloud.record["flap"]["mean_deg"] == 5.0 and cloud.record["flap"]["amplitude_deg"] == 40.0
    assert (cloud.rcs_m2 == 0.01).all()
