"""What is in a recording by the second, and how windows are counted by it."""

import accuracy
import numpy as np
import pytest
from labels import label_of, read_labels

from lowalt.extensions.recordings.answers import Answers
from lowalt.files.errors import InputError


def recognised(radar, seed, device, half, file, label, windows, right):
    """A row of `accuracy.RECOGNITION`."""
    return [
        radar,
        seed,
        device,
        "set",
        half,
        file,
        label,
        windows,
        *[0] * len(accuracy.COUNTED),
        right,
        right,
    ]


def test_balanced_accuracy_counts_every_class_alike_and_every_file_once():
    rows = [recognised("cw", 0, "one", "tuning", "d", "UAV", 3, 10.0)]
    for seed, of_a in ((0, 30.0), (1, 50.0)):
        rows += [
            recognised("cw", seed, "one", "test", "a", "Bird", 10, of_a),
            recognised("cw", seed, "two", "test", "a", "Bird", 20, 80.0),
            recognised("cw", seed, "one", "test", "b", "UAV", 5, 90.0),
            recognised("cw", seed, "one", "test", "b", "nothing", 5, 7.0),
        ]
    found = {tuple(line[:3]): line[3:] for line in accuracy.accuracy_rows(rows, 1)}
    assert {key: line[:4] for key, line in found.items()} == {
        ("cw", "tuning", "UAV"): [1, 1, 3, 10.0],
        ("cw", "test", "Bird"): [2, 2, 30, 60.0],
        ("cw", "test", "UAV"): [1, 1, 5, 90.0],
        ("cw", "test", "Bird by one"): [1, 1, 10, 40.0],
        ("cw", "test", "Bird by two"): [1, 1, 20, 80.0],
        ("cw", "test", "nothing"): [1, 1, 5, 7.0],
        ("cw", "test", "balanced"): [2, 3, 35, 75.0],
    }
    # Two files of a class are drawn with replacement: both bounds are reached, and a class of one
    # file stays.
    assert found["cw", "test", "Bird"][4:] == [40.0, 80.0, 40.0, 80.0, 55.0, 65.0, 60.0]
    assert (
        found["cw", "test", "UAV"][4:6] == [90.0, 90.0]
        and np.isnan(found["cw", "test", "UAV"][6:8]).all()
    )
    assert found["cw", "test", "balanced"][4:6] == [65.0, 85.0]


def test_two_radars_that_differ_widen_the_interval_over_radars_and_not_that_over_files():
    rows = [
        recognised("cw", 0, device, "test", f"{number}", "Vehicle", 5, right)
        for device, right in (("one", 90.0), ("two", 50.0))
        for number in range(8)
    ]
    found = {
        row[2]: dict(zip(accuracy.ACCURACY, row, strict=True))
        for row in accuracy.accuracy_rows(rows, 1)
    }
    vehicle = found["Vehicle"]
    assert (vehicle["devices_low"], vehicle["devices_high"]) == (50.0, 90.0)
    assert 55 < vehicle["low"] < 65 and 75 < vehicle["high"] < 85


def test_windows_count_where_one_interval_holds_them_and_are_right_by_its_label(tmp_path):
    intervals = [(0.0, 1.0, "nothing"), (1.0, 2.0, "Vehicle+Pedestrian"), (2.5, 9.0, "Vehicle")]
    starts = np.arange(8) * 0.4
    labels = [label_of(start, 0.4, intervals) for start in starts]
    assert labels == [
        "nothing",
        "nothing",
        None,
        "Vehicle+Pedestrian",
        "Vehicle+Pedestrian",
        None,
        None,
        "Vehicle",
    ]
    classes = ["UAV", "Vehicle", "Pedestrian", "none of these"]
    present = np.array([False, True, True, True, False, True, True, True])
    beyond = np.full(8, np.nan)
    beyond[4] = 31.0
    shares = np.eye(4)[[0, 3, 0, 2, 0, 0, 0, 0]]
    nowhere = np.zeros(8, bool)
    found = accuracy.said_of(
        Answers(starts, present, shares, nowhere, beyond, nowhere, 20.0, []),
        classes,
        0.4,
        intervals,
    )
    rows = {label: accuracy.counts(label, outcomes) for label, outcomes in accuracy.by_label(found)}
    assert rows["nothing"][0] == 2 and rows["nothing"][-2] == 100.0
    both = dict(zip(accuracy.COUNTED, rows["Vehicle+Pedestrian"][1:-2], strict=True))
    assert {name: count for name, count in both.items() if count} == {"Pedestrian": 1, "beyond": 1}
    # The window beyond the network's speeds is a target that is not named: it counts among all, not
    # among the named.
    assert rows["Vehicle+Pedestrian"][-2:] == [50.0, 100.0] and rows["Vehicle"][-2:] == [0.0, 0.0]
    wrong = tmp_path / "labels.yaml"
    for stretches in (
        "[[2.0, 1.0, Vehicle]]",
        "[[0.0, 1.0, lorry]]",
        "[[0.0, 2.0, UAV], [1.0, 3.0, UAV]]",
    ):
        wrong.write_text(f"one:\n  a.wav: {stretches}\n")
        with pytest.raises(
            InputError, match=r"labels.yaml: one, a.wav: interval \[.*expected seconds that rise"
        ):
            read_labels(wrong)
    assert {"vehicle_24ghz", "car_24ghz", "fourth"} <= set(read_labels())
