"""Some random scenes of `benchmarks/echo_scenes.py`, and that their check finds errors."""

import sys
from pathlib import Path

import numpy as np

import reference

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import echo_scenes


def test_random_scenes_keep_every_promise():
    rows = [row for index in range(8) for row in echo_scenes.examine(7, index)]
    assert len(rows) == 32 and not echo_scenes.failures(rows)
    assert sum(row["refused"] for row in rows) < 4


def test_failures_are_seen():
    good = {
        "tolerance": 1e-6,
        "error": 1e-8,
        "bound": 1e-7,
        "wrong_cells": 0,
        "carrier_hz": 5e9,
        "range_m": 100.0,
    }
    assert not echo_scenes.failures([good])
    for change in ({"error": 2e-6, "bound": 1}, {"bound": 1e-9}, {"wrong_cells": 1}):
        assert echo_scenes.failures([good | change])


def test_the_judge_agrees_with_fifty_digits():
    seen = 0
    for index in range(60):
        network, station, motion, rcs, aim = echo_scenes.scene(7, index)
        if len(rcs) > 6 or network.subcarriers > 64:
            continue
        cells = echo_scenes.judge(network, station, motion, rcs, aim, 5)
        points = np.einsum("lij,lj->li", motion.rotation[5, motion.part], motion.points)
        best = int(abs(cells).argmax())
        # 50 digits on positions rounded to doubles: only scenes near enough for that rounding not
        # to matter.
        points = points + motion.translation[5, motion.part]
        turns = network.carrier_hz * 2 * np.abs(points).max() / 3e8
        truth = reference.cell_mp(network, station, points.tolist(), rcs.tolist(), aim, best)
        assert abs(cells[best] - truth) < (1e-12 + 1e-14 * turns) * abs(cells).sum()
        seen += 1
    assert seen >= 3
