"""The search for a learning rate: rates rise, the loss falls and then runs away, the marks lie where it does so."""

import json

import numpy as np
import pytest

from lowalt.common.csv_tables import read_csv
from lowalt.common.errors import InputError
from lowalt.recognition import rates
from trainings import SCHEME, SETTINGS, sources, with_training

TABLE = "scheme,stations,spectra,fusion,backbone,protocols\nAB:VRP+VT,AB,VRP+VT,attention,,seen\n"


def test_rates_rise_by_the_same_factor_and_only_upwards():
    found = rates.rising(1e-4, 1e-1, 31)
    assert found[0] == pytest.approx(1e-4) and found[-1] == pytest.approx(1e-1)
    np.testing.assert_allclose(found[1:] / found[:-1], 10**0.1)
    for wrong in ((1e-1, 1e-4, 31), (0.0, 1.0, 31), (1e-4, 1e-1, 5)):
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
