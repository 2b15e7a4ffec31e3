"""What `lowalt predict` prints of a recording: the facts of each window, and its line of text."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.io import wavfile

from lowalt.extensions.recordings import answers, predicted
from lowalt.extensions.recordings.record import record
from lowalt.extensions.recordings.window_samples import rendered
from lowalt.recognition.runs import opened


def test_each_fact_of_a_window_stands_under_its_own_key(monkeypatch):
    """Four windows: a bird, one clipped, one with a line beyond the band, one with lost samples."""
    heard = answers.Answers(
        starts_s=np.array([0.0, 0.4, 0.8, 1.2]),
        present=np.array([True, False, False, False]),
        probabilities=np.array([[0.75, 0.25]] * 4),
        clipped=np.array([False, True, False, False]),
        beyond_mps=np.array([math.nan, math.nan, 9.0, math.nan]),
        lost=np.array([False, False, False, True]),
        fastest_mps=6.0,
        notes=["hum"],
    )
    monkeypatch.setattr(answers, "answers", lambda *_: heard)
    model = SimpleNamespace(classes=("Bird", "UAV"))
    windows, text = predicted.answer(model, {}, None, "a.yaml")
    assert [window["target"] for window in windows] == [True, False, False, False]
    assert [window["clipped"] for window in windows] == [False, True, False, False]
    assert [window["lost"] for window in windows] == [False, False, False, True]
    assert [window["beyond_mps"] for window in windows] == [None, None, 9.0, None]
    assert windows[0]["Bird"] == 0.75 and windows[0]["UAV"] == 0.25
    lines = text.splitlines()
    assert "75.00 %  Bird" in lines[0] and "clipped" in lines[1]
    assert "beyond" in lines[2] and "lost" in lines[3]
    assert lines[4] == "1 of 4 windows hold a target: Bird 1, UAV 0" and lines[5] == "note: hum"


def test_a_window_is_named_with_those_of_its_track_and_with_no_others():
    shares = np.full((9, 2), [0.95, 0.05])
    shares[3] = [0.0, 1.0]
    shares[7:] = [0.2, 0.8]
    # The last two windows come 2 s after the others.
    starts_s = np.array([0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.4, 4.4, 4.8])
    together = answers.followed(shares, starts_s)
    assert together.argmax(axis=1).tolist() == [0] * 7 + [1, 1]
    np.testing.assert_allclose(together[7:], shares[7:])
    # All seven windows lie within 1.2 s of the fourth; its own least share counts as 0.001.
    ratio = (0.95 / 0.05) ** (6 / 7) * (answers.LEAST_SHARE / 1.0) ** (1 / 7)
    assert together[3, 0] / together[3, 1] == pytest.approx(ratio)
    assert answers.followed(shares[:0], starts_s[:0]).shape == (0, 2)


def test_what_predict_answers_of_windows_with_a_target_is_of_their_tracks(tmp_path, monkeypatch):
    rate = 8000
    time = np.arange(24 * rate) / rate
    rng = np.random.default_rng(0)
    line = np.cos(2 * np.pi * 960.0 * time) * ((time >= 4.0) & (time < 8.0))
    hum = np.cos(2 * np.pi * 300.0 * time)
    samples = 3000 * line + 200 * hum + rng.normal(0, 90, len(time))
    samples[(time >= 12.0) & (time < 14.8)] = 0
    wavfile.write(tmp_path / "a.wav", rate, samples.astype("i2"))
    about = record(
        {"file": "a.wav", "carrier_hz": 24e9, "channel": "real", "label": "Vehicle"}, tmp_path, "a"
    )
    trained, settings = opened("cw_24ghz")
    shares = np.tile([0.997, 0.001, 0.001, 0.001], (60, 1))
    shares[10:20] = [0.02, 0.02, 0.94, 0.02]
    odd = 14
    shares[odd] = [0.94, 0.02, 0.02, 0.02]
    monkeypatch.setattr(answers, "probabilities", lambda *_: shares)
    seen = []

    def noted(intervals, *others):
        """What is shown to the network, and its images."""
        seen.append(intervals)
        return rendered(intervals, *others)

    monkeypatch.setattr(answers, "rendered", noted)
    found = answers.answers(trained, settings, about, "a")
    assert found.present.nonzero()[0].tolist() == list(range(10, 20))
    assert set(found.outcomes(list(trained.classes))) == {"nothing", "Vehicle", "lost"}
    assert found.lost.nonzero()[0].tolist() == list(range(30, 37))
    # The network sees the line of 960 Hz, but not the hum of 300 Hz; a cell is 2.5 Hz wide.
    power = np.median(np.abs(np.fft.fft(seen[0][10:20], axis=1)) ** 2, axis=0)
    around = np.median(power[100:500])
    assert power[384] > 1e4 * around and power[119:122].max() < 10 * around
