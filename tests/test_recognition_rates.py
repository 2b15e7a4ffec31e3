"""The search for a learning rate: rates rise, the loss falls and then runs away, the marks lie where it does so."""

import json
import struct
from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.common.csv_tables import read_csv
from lowalt.common.errors import InputError
from lowalt.recognition import rates
from lowalt.recognition.schemes import Scheme
from trainings import SCHEME, SETTINGS, sources, with_training

TABLE = "scheme,stations,spectra,fusion,backbone,protocols\nAB:VRP+VT,AB,VRP+VT,attention,,seen\n"


def test_rates_rise_by_the_same_factor_and_only_upwards():
    found = rates.rising(1e-4, 1e-1, 31)
    assert found[0] == pytest.approx(1e-4) and found[-1] == pytest.approx(1e-1)
    np.testing.assert_allclose(found[1:] / found[:-1], 10**0.1)
    assert len(rates.rising(1e-4, 1e-1, 10)) == 10
    for wrong in ((1e-1, 1e-4, 31), (1e-4, 1e-4, 31), (0.0, 1.0, 31), (1e-4, 1e-1, 9)):
        with pytest.raises(InputError, match="low < high"):
            rates.rising(*wrong)


def test_smoothed_losses_are_means_whose_weights_sum_to_one():
    np.testing.assert_allclose(rates.smooth([2.0] * 20), 2.0)
    weights = 0.9 ** np.arange(4)[::-1]
    losses = [3.0, 1.0, 4.0, 1.5]
    assert rates.smooth(losses)[-1] == pytest.approx(np.average(losses, weights=weights))


def test_the_marks_are_the_steepest_fall_and_the_least_loss():
    steps = rates.rising(1e-6, 1.0, 121)
    place = np.log10(steps)
    course = 1.4 - np.tanh(3 * (place + 3)) / 2 + np.where(place > -1, 5 * (place + 1) ** 2, 0)
    fastest, least = rates.marks(steps, course)
    assert fastest == pytest.approx(1e-3, rel=0.13) and 1e-2 < least < 0.2
    with pytest.raises(InputError, match="never fell"):
        rates.marks(steps, np.linspace(1, 2, 121))
    with pytest.raises(InputError, match="never fell"):
        rates.marks(steps[:0], np.zeros(0))


def test_the_first_tenth_of_the_steps_and_all_after_the_least_loss_hold_no_mark():
    for count, first in ((20, 2), (18, 1), (9, 0)):
        steps, course = np.geomspace(1, 2, count), np.linspace(3.0, 2.5, count)
        # The steepest fall is the first, whose slope reaches to the second step; then one later, and the least loss.
        course[0] += 40
        course[first + 4 :] -= 1
        course[-3:] = course[-4] + np.array([5.0, 0.5, 0.1])
        wanted = np.gradient(course, np.log(steps))
        falls = min(range(first, count - 3), key=lambda number: wanted[number])
        assert rates.marks(steps, course) == (steps[falls], steps[-4])
    # The fall may be steepest at the least loss itself, by the slope over both its neighbours.
    steps, course = np.geomspace(1, 2, 12), np.array([2, 2, 2, 2, 2, 0.9, 1, 0, 0.01, 3, 3, 3.0])
    course[3:5] = [0.9, 0.9]
    assert rates.marks(steps, course)[1] == steps[7]
    assert rates.marks(steps[5:], course[5:])[0] == steps[7]


def test_epochs_follow_each_other_until_there_are_steps_enough(monkeypatch):
    """Seven samples in batches of three are two steps an epoch; each epoch has its own order."""
    trainer = SimpleNamespace(train=SimpleNamespace(facts=range(7)), seed=3, keys=("a",),
                              block={"snrs_per_model": 2, "batch": 3})  # fmt: skip
    asked = []

    def ordered(facts, seed, keys, epoch, few):
        asked.append((len(facts), seed, keys, epoch, few))
        return 10 * epoch + np.arange(7)

    monkeypatch.setattr(rates, "epoch_order", ordered)
    found = rates._endless(trainer, 5)
    assert [(step, part.tolist()) for step, part in found] == [
        (0, [0, 1, 2]), (1, [3, 4, 5]), (2, [10, 11, 12]), (3, [13, 14, 15]), (4, [20, 21, 22])]  # fmt: skip
    assert asked == [(7, 3, ("a",), epoch, 2) for epoch in range(3)]
    assert len(rates._endless(trainer, 4)) == 4 and len(asked) == 5


@pytest.mark.parametrize(("scheme", "stream"), [(Scheme("x", (0,), (), method="svm"), 0.0), (SCHEME, 0.5)])
def test_methods_without_rates_and_fresh_samples_are_refused(scheme, stream, tmp_path):
    with pytest.raises(InputError, match=r"expected a network and training\.stream 0"):
        rates.find(None, scheme, "seen", with_training(stream=stream), tmp_path, np.ones(3))


def test_images_or_signals_are_asked_for_by_what_the_scheme_sees(tmp_path):
    (tmp_path / "schemes.csv").write_text(
        "scheme,stations,spectra,fusion,backbone,protocols,size,method\nimages,A,VT,attention,,seen,,\n"
        "signals,A,,attention,,seen,400,cnn\n"
    )
    line = ["--settings", json.dumps(SETTINGS), "--protocol", "seen", "--schemes", str(tmp_path / "schemes.csv"),
            "--stations", "A", "--out", str(tmp_path)]  # fmt: skip
    for name, option, other in (("images", "--views", "--signals"), ("signals", "--signals", "--views")):
        with pytest.raises(InputError, match=f"{option}: missing, scheme sees {name}"):
            rates.main([*line, "--scheme", name, other, "a.npz"])


def test_a_search_writes_table_and_figure_and_gives_equal_bytes_again(views, tmp_path):
    (tmp_path / "schemes.csv").write_text(TABLE)
    settings = with_training(label_smoothing=0.0)
    line = ["--settings", json.dumps(settings), "--views", str(views), "--protocol", "seen", "--scheme", SCHEME.slug,
            "--schemes", str(tmp_path / "schemes.csv"), "--stations", "A", "B", "--from", "1e-5", "--to", "3",
            "--steps", "60", "--out"]  # fmt: skip
    for name in ("one", "two"):
        rates.main([*line, str(tmp_path / name)])
        assert sorted(path.name for path in (tmp_path / name).iterdir()) == ["rates.csv", "rates.png"]
    assert (tmp_path / "one/rates.csv").read_bytes() == (tmp_path / "two/rates.csv").read_bytes()
    rows = read_csv(tmp_path / "one/rates.csv", *rates.COLUMNS)
    found = {name: np.array([float(row[name]) for row in rows]) for name in rates.COLUMNS}
    np.testing.assert_allclose(found["rate"], rates.rising(1e-5, 3, 60)[: len(rows)], rtol=1e-5)
    np.testing.assert_allclose(found["smoothed"], rates.smooth(found["loss"]), rtol=1e-4)
    assert [int(row["step"]) for row in rows] == list(range(1, len(rows) + 1))
    # The picture has 6.4 x 4 inches at 120 pixels an inch.
    assert (tmp_path / "one/rates.png").read_bytes()[16:24] == struct.pack(">II", 768, 480)
    # Four classes that brightness tells apart: chance is log 4, and the best rate learns some of it on the way.
    assert abs(found["loss"][:5].mean() - np.log(4)) < 0.4
    assert found["smoothed"].min() < 0.8 * found["smoothed"][5]
    # The first step's loss is that of the fresh network, which no rate can change.
    high = [*line[:-1][: line.index("--from")], "--from", "1", "--to", "3", "--steps", "10", "--out"]
    with pytest.raises(InputError, match="never fell"):
        rates.main([*high, str(tmp_path / "high")])
    assert read_csv(tmp_path / "high/rates.csv")[0]["loss"] == rows[0]["loss"]


def test_a_search_ends_where_the_loss_runs_away_or_is_not_finite(views, monkeypatch, tmp_path):
    series = iter([2.0, 1.0, 0.5, 0.4, 90.0, 1.0])
    monkeypatch.setattr(rates, "descent", lambda *given: next(series))
    monkeypatch.setattr(rates, "marks", lambda steps, smoothed: (steps[0], steps[-1]))
    rates.find(sources(views)["train"], SCHEME, "seen", SETTINGS, tmp_path, rates.rising(1e-3, 1, 10))
    assert [row["loss"] for row in read_csv(tmp_path / "rates.csv")] == ["2", "1", "0.5", "0.4"]
    series = iter([2.0, float("nan"), 1.0])
    rates.find(sources(views)["train"], SCHEME, "seen", SETTINGS, tmp_path, rates.rising(1e-3, 1, 10))
    assert len(read_csv(tmp_path / "rates.csv")) == 1
