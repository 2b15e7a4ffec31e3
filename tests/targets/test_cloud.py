"""The cloud file: what is written is read back bit by bit.

What breaks the contract is refused by name.
"""

import dataclasses

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.targets.cloud import Cloud, check, read, write

RECORD = {"subtype": "Test craft", "category": "UAV", "source": "builtin", "checksum": "0" * 64}


def craft(**changes) -> Cloud:
    """A body of three points and a rotor of two, with any field changed."""
    nan = [np.nan] * 3
    fields = {
        "points": np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.1], [1, 1.2, 0.1]]) / 3,
        "part": np.array([0, 0, 0, 1, 1]),
        "kinds": ("body", "rotor"),
        "names": ("body", "rotor 1"),
        "parents": np.array([-1, -1]),
        "hinges": np.array([nan, [1 / 3, 1.1 / 3, 0.0]]),
        "axes": np.array([nan, [0, 0, -1.0]]),
        "normals": np.array([[0, 0, 1.0]] * 4 + [nan]),
        "rcs_m2": np.ones(5),
        "record": dict(RECORD),
    }
    return Cloud(**(fields | changes))


def recording(frames: int, **record) -> Cloud:
    """Two nodes that swing to and fro."""
    track = np.random.default_rng(0).normal(size=(frames, 2, 3))
    return craft(
        points=np.zeros((2, 3)),
        part=np.array([0, 1]),
        kinds=("node", "node"),
        names=("root", "head"),
        hinges=np.full((2, 3), np.nan),
        axes=np.full((2, 3), np.nan),
        normals=np.full((2, 3), np.nan),
        rcs_m2=np.ones(2),
        track=track,
        record=RECORD | {"category": "Pedestrian"} | record,
    )


@pytest.mark.parametrize(
    "cloud", [craft(), recording(5, track_rate_hz=120.0)], ids=["rigid", "nodes"]
)
def test_written_and_read_back_bit_by_bit(tmp_path, cloud):
    write(tmp_path / "a.npz", cloud)
    write(tmp_path / "b.npz", cloud)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    with np.load(tmp_path / "a.npz", allow_pickle=False) as data:  # as other tools open it
        assert data["points"].dtype == np.float64 and data["part"].dtype == np.int64
    back = read(tmp_path / "a.npz")
    for field in dataclasses.fields(Cloud):
        before = getattr(cloud, field.name)
        after = getattr(back, field.name)
        if isinstance(before, np.ndarray):
            np.testing.assert_array_equal(after, before)
            assert after.dtype == before.dtype
        else:
            assert after == before


ROTOR = craft()
WRONG = {
    "points is empty": craft(points=np.zeros((0, 3))),
    "points has shape": craft(points=np.zeros((5, 2))),
    "points has a coordinate that is no number within 1000 m": craft(
        points=np.full((5, 3), np.inf)
    ),
    "rcs_m2 has a value that is no number from 0": craft(rcs_m2=-np.ones(5)),
    "unique names": craft(names=("body", "body")),
    "expected only": craft(kinds=("body", "tail")),
    "outside 0..1": craft(part=np.array([0, 0, 0, 1, 2])),
    "expected an earlier part": craft(parents=np.array([-1, 1])),
    "has length 2.0, expected 1": craft(axes=2 * ROTOR.axes),
    "is no place within 1000 m": craft(hinges=np.full((2, 3), np.nan)),
    "length other than 1 or NaN": craft(normals=np.ones((5, 3))),
    "record lacks": craft(record={"subtype": "x", "category": "UAV"}),
    "expected a key `like` with one of": craft(record=RECORD | {"category": "Boat"}),
    "'tail'] are no parts that turn, expected some of": craft(
        record=RECORD | {"rate_factors": {"tail": 5}}
    ),
    "expected numbers from 0 to 100": craft(record=RECORD | {"rate_factors": {"rotor 1": -1}}),
    "expected numbers by the parts' names": craft(record=RECORD | {"rate_factors": [1]}),
    "track has shape": recording(1, track_rate_hz=120.0),
    "track_rate_hz is missing": recording(5),
}


@pytest.mark.parametrize("message", WRONG)
def test_broken_clouds_are_refused_and_not_written(tmp_path, message):
    with pytest.raises(InputError, match=message) as refusal:
        check(WRONG[message], "here.npz")
    assert str(refusal.value).startswith("here.npz: ")
    with pytest.raises(InputError):
        write(tmp_path / "x.npz", WRONG[message])
    assert list(tmp_path.iterdir()) == []


def test_files_that_are_no_clouds_are_refused(tmp_path):
    good = tmp_path / "good.npz"
    write(good, craft())
    (tmp_path / "text.npz").write_text("no archive")
    (tmp_path / "short.npz").write_bytes(good.read_bytes()[:900])
    np.savez(tmp_path / "other.npz", points=np.zeros((3, 3)))
    with np.load(good) as data:
        arrays = dict(data)
    np.savez(tmp_path / "record.npz", **(arrays | {"record": np.array("[1")}))
    for name in ("text", "short", "other", "record"):
        with pytest.raises(InputError, match=rf"{name}\.npz: not a cloud file"):
            read(tmp_path / f"{name}.npz")
    with pytest.raises(InputError, match=r"no file at .*absent\.npz"):
        read(tmp_path / "absent.npz")
