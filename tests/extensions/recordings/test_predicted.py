"""What `lowalt predict` prints of a recording: the facts of each window, and its line of text."""

import math
from types import SimpleNamespace

import numpy as np

from lowalt.extensions.recordings import answers, predicted


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
