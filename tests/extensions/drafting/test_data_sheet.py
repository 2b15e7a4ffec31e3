"""Targets drafted from a data sheet.

What it states stands in the record, the rest grows with the size.
"""

import warnings

import numpy as np
import pytest
import yaml

import lowalt
from lowalt.__main__ import main
from lowalt.files.errors import InputError
from lowalt.targets.cloud import read
from lowalt.targets.make import make
from lowalt.targets.records import estimates, merge, with_row

pytestmark = pytest.mark.usefixtures("without_target_picture")
DRONE = [
    "--rotors",
    "6",
    "--diagonal",
    "1.13",
    "--propeller",
    "0.53",
    "--blades",
    "2",
    "--rate",
    "50:120",
]
BIRD = ["--length", "0.46", "--span", "0.99", "--rate", "3:5"]
CAR = [
    "--length",
    "4.6",
    "--width",
    "1.85",
    "--height",
    "1.44",
    "--wheel",
    "0.67",
    "--wheel-base",
    "2.85",
]
SPEED = ["--speed", "18"]
STATED_DRONE = {
    "rotors": 6,
    "diagonal": 1.13,
    "propeller": 0.53,
    "blades": 2,
    "rate": (50.0, 120.0),
    "speed": 18.0,
}
STATED_CAR = {
    "length": 4.6,
    "width": 1.85,
    "height": 1.44,
    "wheel": 0.67,
    "wheel_base": 2.85,
    "speed": 18.0,
}


def refusal(arguments, capsys):
    """What a refused command says."""
    assert main(["target", *arguments]) == 2
    return capsys.readouterr().err


def drafted_cloud(kind, **stated):
    """The cloud of a drafted target."""
    text, _ = lowalt.draft_target(kind, subtype="mine", **stated)
    record = yaml.safe_load(text)["mine"]
    row = with_row(None, "mine", record.pop("row"), "draft")
    return make(merge(row, record, "draft"), None, 1)


@pytest.fixture
def drafts(tmp_path):
    """The record files of a drone, a bird and a vehicle."""
    result = {}
    for kind, given in {"drone": DRONE, "bird": BIRD, "vehicle": CAR}.items():
        result[kind] = tmp_path / f"my-{kind}.yaml"
        assert main(["target", kind, *given, *SPEED, "--out", str(result[kind])]) == 0
    return result


def test_a_drone_has_the_sheet_s_rotors_propellers_and_diagonal(drafts, tmp_path):
    assert main(["target", "make", str(drafts["drone"]), "--out", str(tmp_path / "drone.npz")]) == 0
    cloud = read(tmp_path / "drone.npz")
    rotors = [part for part, kind in enumerate(cloud.kinds) if kind == "rotor"]
    hubs = cloud.hinges[rotors][:, :2]
    assert len(rotors) == 6
    assert np.linalg.norm(hubs[:, None] - hubs, axis=2).max() == pytest.approx(1.13, rel=1e-6)
    for part, hub in zip(rotors, hubs, strict=True):
        reach = np.linalg.norm(cloud.points[cloud.part == part][:, :2] - hub, axis=1).max()
        assert reach == pytest.approx(0.53 / 2, rel=0.02)
    published = cloud.record["published"]
    assert (published["freq_lo_hz"], published["freq_hi_hz"], published["vx_abs_max"]) == (
        50,
        120,
        18,
    )
    # Nine stated: two figures, and of the row all but the climb.
    guessed, figures = estimates(cloud.record)
    assert figures - guessed == 7


def test_a_bird_and_a_vehicle_have_the_sheet_s_sizes(drafts, tmp_path):
    extents = {}
    for kind in ("bird", "vehicle"):
        assert (
            main(["target", "make", str(drafts[kind]), "--out", str(tmp_path / f"{kind}.npz")]) == 0
        )
        extents[kind] = np.ptp(read(tmp_path / f"{kind}.npz").points, axis=0)
    assert extents["bird"][:2] == pytest.approx([0.99, 0.46], rel=0.03)
    assert extents["vehicle"] == pytest.approx([1.85, 4.6, 1.44], rel=0.06)
    wheels = read(tmp_path / "vehicle.npz")
    axles = wheels.hinges[[kind == "wheel" for kind in wheels.kinds]][:, 1]
    assert np.ptp(axles) == pytest.approx(2.85)


@pytest.mark.parametrize("frame", ["car", "bus"])
def test_a_vehicle_rolls_on_the_wheel_of_its_sheet(frame):
    stated = STATED_CAR | {"wheel": 0.69}
    cloud = drafted_cloud("vehicle", frame=frame, **stated)
    wheel = cloud.part == cloud.kinds.index("wheel")
    assert cloud.record["wheel_diameter_m"] == 0.69
    assert np.ptp(cloud.points[wheel][:, 2]) == pytest.approx(0.69, rel=0.02)


def test_a_coaxial_frame_carries_two_rotors_on_each_arm_that_turn_against_each_other():
    # DJI Agras T40: eight rotors of 54 inch on four arms.
    stated = {
        "rotors": 8,
        "diagonal": 2.184,
        "propeller": 1.375,
        "blades": 2,
        "rate": (10.0, 30.0),
        "speed": 10.0,
    }
    cloud = drafted_cloud("drone", frame="coaxial", **stated)
    rotors = [part for part, kind in enumerate(cloud.kinds) if kind == "rotor"]
    hubs = cloud.hinges[rotors]
    axes = cloud.axes[rotors]
    assert len(rotors) == 8
    assert np.linalg.norm(hubs[:, None, :2] - hubs[:, :2], axis=2).max() == pytest.approx(2.184)
    for index in range(8):
        pair = [
            other
            for other in range(8)
            if np.allclose(hubs[index, :2], hubs[other, :2]) and other != index
        ]
        assert len(pair) == 1
        assert abs(hubs[index, 2] - hubs[pair[0], 2]) > 0.05
        assert axes[index, 2] == -axes[pair[0], 2]
        blades = cloud.points[cloud.part == rotors[index]][:, :2] - hubs[index, :2]
        assert np.linalg.norm(blades, axis=1).max() == pytest.approx(1.375 / 2, rel=0.03)
    with pytest.raises(InputError, match="rotors is 7, expected an even number"):
        lowalt.draft_target("drone", frame="coaxial", **{**stated, "rotors": 7})


def test_what_the_sheet_does_not_say_grows_with_the_size(drafts, tmp_path):
    twice = [{"1.13": "2.26", "0.53": "1.06"}.get(word, word) for word in DRONE]
    frame = f"--frame radial --climb 3 --subtype Twice --out {tmp_path}/twice.yaml".split()
    assert main(["target", "drone", *twice, *SPEED, *frame]) == 0
    small = yaml.safe_load(drafts["drone"].read_text())["my-drone"]
    large = yaml.safe_load((tmp_path / "twice.yaml").read_text())["Twice"]
    for name, (value, unit, _) in small["figures"].items():
        assert large["figures"][name][0] == pytest.approx(
            value * (2 if unit == "m" else 1), rel=0.01
        )
    assert large["row"]["vz_abs_max"] == 3 and "vz_abs_max" in large["row_from"]
    assert "vz_abs_max" not in small["row_from"]


def test_python_drafts_the_same_record_and_refuses_what_a_sheet_lacks(drafts, tmp_path):
    stated = STATED_DRONE
    text, lender = lowalt.draft_target("drone", subtype="my-drone", **stated)
    assert text == drafts["drone"].read_text() and lender in text
    assert (
        lowalt.draft_target("drone", tmp_path / "again.yaml", subtype="my-drone", **stated)[0]
        == text
    )
    assert (tmp_path / "again.yaml").read_text() == text
    lacking = {word: value for word, value in stated.items() if word != "blades"}
    for kind, wrong, words in (
        ("drone", lacking, "it states"),
        ("drone", {**stated, "wheel": 1.0}, "it states"),
        ("drone", {**stated, "rate": (1, 2, 3)}, "rate is .*, expected 2 numbers"),
        ("boat", stated, "no kind"),
    ):
        with pytest.raises(InputError, match=words):
            lowalt.draft_target(kind, **wrong)


def test_its_echo_is_made_by_its_name(drafts):
    own = {
        "network": {"symbols": 64, "subcarriers": 16},
        "targets": {"own": {"mine": str(drafts["drone"])}},
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        echo = lowalt.receive(own, "my-drone", at="signal")
    assert echo.values.shape == (64,) and abs(echo.values).min() > 0 and len(echo.parts) == 7


def test_wrong_sheets_are_refused_in_words_of_the_command(tmp_path, capsys):
    given = ["drone", *DRONE, *SPEED]
    assert "--frame is 'hexa', expected one of ['folding', 'ducted', 'raised', 'radial'" in refusal(
        [*given, "--frame", "hexa"], capsys
    )
    assert "expected n_rotors_or_wings 4 in its row, not 6" in refusal(
        [*given, "--frame", "folding"], capsys
    )
    wide = [word.replace("0.53", "0.63") for word in given]
    assert "figures.propeller_diameter is 0.63 m, expected less than the 0.565 m" in refusal(
        wide, capsys
    )
    assert "--frame is 'radial', expected one of ['car', 'bus']" in refusal(
        ["vehicle", *CAR, *SPEED, "--frame", "radial"], capsys
    )
    (tmp_path / "there.yaml").write_text("")
    assert "is there already" in refusal([*given, "--out", str(tmp_path / "there.yaml")], capsys)
    assert not (tmp_path / "there.yaml").read_text()
    with pytest.raises(SystemExit):
        main(["target", *[word.replace("50:120", "120:50") for word in given]])
    assert "'120:50', expected LOW:HIGH in Hz" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("diagonal", "lender"), [(1.13, "DJI Matrice 600 Pro"), (0.52, "Yuneec H520")]
)
def test_the_published_craft_nearest_in_size_lends_its_figures(diagonal, lender):
    stated = STATED_DRONE | {"diagonal": diagonal, "propeller": 0.1}
    assert lowalt.draft_target("drone", **stated)[1] == lender


@pytest.mark.parametrize(
    ("word", "grown"),
    [("width", {"track", "tyre_width"}), ("height", {"ground_clearance"})],
)
def test_a_figure_of_a_vehicle_grows_with_its_own_side_alone(word, grown):
    stated = STATED_CAR | {"wheel_base": 2.0}
    figures = []
    for factor in (1.0, 1.1):
        text, _ = lowalt.draft_target("vehicle", **(stated | {word: stated[word] * factor}))
        figures.append(yaml.safe_load(text)["My vehicle"]["figures"])
    small, large = figures
    for name, (value, unit, _) in small.items():
        assert large[name][0] == pytest.approx(
            value * (1.1 if name in grown and unit == "m" else 1.0), rel=0.006
        )
