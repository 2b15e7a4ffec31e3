"""The prediction file: what is written is read back, and each fault is named with its line."""

import json
import math

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.recognition import predictions
from lowalt.recognition.samples import Facts

HEAD = "key,subtype,group,fold,model,snr_db,label,range_m,aspect_deg,p_uav,p_bird,p_vehicle,p_pedestrian\n"
GOOD = "a,Crow,seen,test,3,inf,1,,,0.1,0.6,0.2,0.1\n"


def facts():
    """Two samples at three stations; the second is near the second station, and the third knows no
    distance.
    """
    return Facts(
        key=np.array(["b", "a"]),
        subtype=np.array(["Crow", "Dove"]),
        model=np.array([3, 4]),
        snr_db=np.array([3.0, math.inf]),
        group=np.array(["seen", "unseen"]),
        fold=np.array(["val", "test"]),
        label=np.array([1, 0]),
        range_m=np.array([[90.0, 120.0, 30.0], [70.5, 60.25, math.nan]]),
        aspect_rad=np.array([[0.5, 1.0, 1.5], [2.0, math.pi, 0.1]]),
    )


def test_range_and_aspect_are_those_of_the_nearest_station_used():
    shares = np.array([[0.5, 0.5, 0.0, 0.0], [0.25, 0.25, 0.25, 0.25]])
    found = predictions.from_facts(facts(), (0, 1), shares)
    assert found.range_m.tolist() == [90.0, 60.25] and found.aspect_deg == pytest.approx(
        [math.degrees(0.5), 180.0]
    )
    alone = predictions.from_facts(facts(), (2,), shares)
    assert alone.range_m[0] == 30.0 and math.isnan(alone.range_m[1])
    others = predictions.from_facts(facts(), (1, 2), shares)
    assert others.range_m.tolist() == [30.0, 60.25] and others.aspect_deg == pytest.approx(
        [math.degrees(1.5), 180.0]
    )
    assert found.guesses.tolist() == [0, 0] and found.correct.tolist() == [False, True]
    assert found.motion.tolist() == ["Crow/3", "Dove/4"]
    assert found.of({("unseen", "test"), ("seen", "val")}).key.tolist() == ["a", "b"]
    assert found.of({("unseen", "val"), ("seen", "val")}).key.tolist() == ["b"]


def test_a_file_holds_every_column_and_is_read_back_as_it_was(tmp_path):
    shares = np.array([[0.1 + 0.2, 0.7, 0.0, 0.0], [1 / 3, 1 / 3, 1 / 3, 0.0]])
    told = predictions.from_facts(facts(), (2, 1), shares)
    predictions.write(tmp_path / "p.csv", told)
    lines = (tmp_path / "p.csv").read_text().splitlines()
    assert lines[0] + "\n" == HEAD
    assert lines[1].startswith("b,Crow,seen,val,3,3.0,1,30.0,") and lines[2].startswith(
        "a,Dove,unseen,test,4,inf,0,60.25,"
    )
    found = predictions.read(tmp_path / "p.csv")
    for name, value in vars(told).items():
        np.testing.assert_array_equal(getattr(found, name), value)
    assert len(found) == 2 and found.model.dtype == found.label.dtype == np.int64
    # Folds of a study's own have no parts.
    for protocol, part in (("unseen", ",part"), ("without fold 0", "")):
        predictions.write(tmp_path / "q.csv", told.take([1]), protocol=protocol)
        assert (tmp_path / "q.csv").read_text().splitlines()[0] == lines[0] + part


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (
            GOOD + "b,Crow,seen,test,3,3,1,,,0.1,0.6,0.2,0.1021\n",
            "line 3: probabilities .*0.1021.*, expected 4 >= 0",
        ),
        (GOOD + "b,Crow,seen,test,3,3,1,,,0.1,0.6,0.2,0.0979\n", "line 3: probabilities"),
        ("b,Crow,seen,test,3,3,1,,,-0.1,0.8,0.2,0.1\n" + GOOD, "line 2: probabilities"),
        (GOOD + "b,Crow,seen,test,3,3,1,,,nan,0.6,0.2,0.1\n", "line 3: probabilities"),
        (
            GOOD + GOOD.replace("a,", "b,", 1) + "c,Crow,seen,test,x,3,1,,,1,0,0,0\n",
            "line 4: invalid literal",
        ),
        (GOOD + "b,Crow,seen,test,3\n", "line 3: "),
        (GOOD + GOOD, "a key stands twice"),
        ("", "no predictions"),
    ],
)
def test_each_fault_is_named_with_its_line(body, words, tmp_path):
    (tmp_path / "p.csv").write_text(HEAD + body)
    with pytest.raises(InputError, match=words):
        predictions.read(tmp_path / "p.csv")


def test_sums_within_a_thousandth_and_probabilities_of_zero_are_taken(tmp_path):
    rows = ("b,Crow,seen,test,3,3,1,,,0,1.0009,0,0\n", "c,Crow,seen,test,3,3,1,,,0,0.9991,0,0\n")
    (tmp_path / "p.csv").write_text(HEAD + "".join(rows))
    assert predictions.read(tmp_path / "p.csv").guesses.tolist() == [1, 1]


def test_a_record_is_a_json_object_next_to_the_file(tmp_path):
    side = tmp_path / "p.json"
    with pytest.raises(InputError, match=r"p\.json"):
        predictions.record(tmp_path / "p.csv")
    for text in ("[1]", "{", "[" * 100_000):
        side.write_text(text)
        with pytest.raises(InputError, match=r"p\.json: not a run record"):
            predictions.record(tmp_path / "p.csv")
    side.write_text(json.dumps({"seed": 3}))
    assert predictions.record(tmp_path / "p.csv") == {"seed": 3}
