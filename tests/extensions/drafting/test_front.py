"""Where the front of a target is.

Each kind of evidence, evidence that contradicts itself or the user, and its law.
"""

import numpy as np
import pytest
import yaml

from lowalt.__main__ import main
from lowalt.extensions.drafting.front import Shape, Turning, front_of
from lowalt.files.errors import InputError
from lowalt.targets.cloud import read
from made_robots import car_urdf

pytestmark = pytest.mark.usefixtures("without_target_picture")
UP = np.array([0.0, 0.0, 1.0])
BOX = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-0.1, 0.1)])
FOUR = {"a": (1, 1), "b": (1, -1), "c": (-1, 1), "d": (-1, -1)}


def shape(category="UAV", named=None, turning=(), steered=(), points=BOX) -> Shape:
    """What is seen of a target with these parts, up along z."""
    named = {name: np.array([*place, 0.0])[:3] for name, place in (named or {}).items()}
    return Shape(
        category,
        UP,
        points,
        named,
        [Turning(*part) for part in turning],
        [np.array(at) for at in steered],
    )


@pytest.mark.parametrize(
    ("named", "front"),
    [
        ({"front_arm": (0, -1), "rear_arm": (0, 1)}, "-y"),
        ({"left wing": (1, 0), "rightWing": (-1, 0)}, "-y"),
        ({"noseCone": (-1, 0)}, "-x"),
        ({"tail": (0, -1)}, "y"),
        # Each pair of corners lies along a diagonal, but only one front suits both words.
        ({"front_right_prop": (1, -1), "back_left_prop": (-1, 1)}, "x"),
        ({"motor_fl": (1, 1), "motor_fr": (1, -1), "motor_rl": (-1, 1), "motor_rr": (-1, -1)}, "x"),
    ],
)
def test_names_tell_the_front_by_the_places_of_their_parts(named, front):
    found = front_of(shape(named=named), None, None, "z")
    assert (found.axis, found.sure) == (front, True) and "names such as" in found.comment
    assert "GUESSED" not in found.comment


def wheels(axis, places=FOUR) -> list[tuple]:
    """Wheels at places whose axles lie along an axis."""
    return [(name, np.array([*at, 0.0]), np.array(axis, float)) for name, at in places.items()]


def test_axles_tell_the_axis_steered_wheels_the_sign_and_the_usual_front_where_none_is_steered():
    along_y = front_of(shape("Vehicle", turning=wheels([1, 0, 0])), None, "x", "x")
    assert (along_y.axis, along_y.sure) == ("y", False)
    assert "GUESSED, please confirm: y or -y; the wheel axles" in along_y.comment
    usual = front_of(shape("Vehicle", turning=wheels([0, 1, 0])), None, "x", "y")
    assert (usual.axis, usual.sure) == (
        "x",
        True,
    ) and "x is the front of such files" in usual.comment
    steered = front_of(
        shape("Vehicle", turning=wheels([1, 0, 0]), steered=[(1, -1, 0), (-1, -1, 0)]),
        None,
        "x",
        "x",
    )
    assert (steered.axis, steered.sure) == ("-y", True) and "the steered wheels" in steered.comment


def test_a_propeller_tells_the_axis_and_a_tail_rotor_lies_behind():
    lift = [(name, np.array([*at, 0.1]), UP) for name, at in FOUR.items()]
    pusher = ("p", np.array([0.0, 0.5, 0.0]), np.array([0.0, -1.0, 0.0]), True)
    found = front_of(shape(turning=[*lift, pusher]), None, "x", "x")
    assert (found.axis, found.sure) == ("-y", False) and "the axis of the propeller" in found.words
    main_rotor = ("main", np.array([0.0, 0.0, 0.3]), UP)
    tail = ("small", np.array([0.1, 0.9, 0.2]), np.array([1.0, 0.0, 0.0]), True)
    found = front_of(shape(turning=[main_rotor, tail]), None, "x", "x")
    assert (found.axis, found.sure, found.words) == ("-y", True, "the tail rotor")


def test_a_mirror_plane_and_long_sides_are_guesses_and_without_any_evidence_the_usual_front_is_one():
    plane = np.concatenate([BOX, [(0, 1.5, 0), (0, 1.4, 0.3)]])
    found = front_of(shape(points=plane), None, None, "x")
    assert (found.axis, found.sure, found.words) == ("y", False, "the mirror plane")
    bus = front_of(shape("Vehicle", points=BOX * [1, 3, 2]), None, "x", "x")
    assert (bus.axis, bus.sure, bus.words) == ("y", False, "the long axis")
    wing = front_of(shape(points=BOX * [1, 3, 2]), None, None, "z")
    assert (wing.axis, wing.sure, wing.words) == ("x", False, "the span")
    assert (
        front_of(shape(points=BOX * [3, 1, 2]), None, "x", "y").axis == "x"
    )  # the convention outweighs a span
    none = front_of(shape(), None, "x", "y")
    assert (none.axis, none.sure) == ("x", False) and "no part tells" in none.comment
    assert front_of(shape(), "-y", "x", "x").comment == ""


def test_evidence_that_contradicts_itself_or_the_user_is_refused_with_the_option_that_resolves_it():
    named = {"front_bumper": (1, 0), "rear_bumper": (-1, 0)}
    car = shape("Vehicle", named, wheels([1, 0, 0]))
    words = (
        "names such as 'front_bumper' say that the front is x, the wheel axles that it is y: give"
        " --front=x or"
    )
    with pytest.raises(InputError, match=words):
        front_of(car, None, "x", "x")
    assert front_of(car, "y", "x", "x").axis == "y"
    with pytest.raises(
        InputError, match="--front is x, but the wheel axles say that the front is y or -y: give"
    ):
        front_of(car, "x", "x", "x")
    both = {
        "front_a": (1, 0),
        "rear_a": (-1, 0),
        "tail_b": (0.9, 0),
        "nose_c": (0.5, 0),
        "left": (0, -1),
    }
    assert front_of(shape(named=both | {"right": (0, 1)}), "-x", None, "x").axis == "-x"


def test_a_description_turned_by_a_quarter_gives_the_same_cloud(tmp_path):
    clouds = []
    for turned in (False, True):
        path = tmp_path / f"car{turned:d}.urdf"
        path.write_text(car_urdf(turned))
        out = tmp_path / f"{turned}.yaml"
        words = ["--inputs", str(tmp_path), "--out"]
        assert (
            main(
                [
                    "target",
                    "new",
                    str(path),
                    "--subtype",
                    "car",
                    "--category",
                    "Vehicle",
                    *words,
                    str(out),
                ]
            )
            == 0
        )
        record = yaml.safe_load(out.read_text())["car"]
        # A wheel at the front is steered; a steering wheel turns without end and is no wheel.
        assert record["front"] == ("y" if turned else "x") and len(record["parts"]) == 5
        made = out.with_suffix(".npz")
        assert main(["target", "make", str(out), *words, str(made)]) == 0
        clouds.append(read(made))
    np.testing.assert_allclose(
        np.sort(clouds[0].hinges[1:], axis=0), np.sort(clouds[1].hinges[1:], axis=0), atol=1e-4
    )
    np.testing.assert_allclose(np.abs(clouds[1].axes[1:, 0]), 1, atol=1e-9)
    np.testing.assert_allclose(
        np.ptp(clouds[0].points, axis=0), np.ptp(clouds[1].points, axis=0), rtol=1e-3
    )
