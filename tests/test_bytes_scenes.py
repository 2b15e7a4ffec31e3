"""Scenes have the same signals whichever kernels a BLAS chooses, and with
the vector registers of AVX2 as with those of this processor.

The comparison is of double precision, before rounding to the kept precision hides all but a few
differences.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from blas_kernels import CORES, differing, signals

ROOT = Path(__file__).parents[1]
SCENES = ("config/scenes/triangle.yaml", "config/scenes/sensing.yaml")


def test_signals_with_canceller_links_and_phase_noise_do_not_follow_the_processor(tmp_path):
    """Two scenes that call for most of the linear algebra on the newest processor and on one without
    its registers; looks are short, and older processors are left to the slow test, so that the
    processes take seconds."""
    assert differing(signals(tmp_path, CORES[:2], 64, "Owl", *SCENES)) == []


SHIPPED = sorted(
    f"config/scenes/{path.name}"
    for path in (ROOT / "config/scenes").glob("*.yaml")
    if path.stem != "paper"
)


@pytest.mark.slow
def test_signals_of_every_shipped_scene_do_not_follow_the_processor(tmp_path):
    subtypes = "DJI Mini 2,Owl,NIO ET5T 2023,Walking Pedestrian 1"
    made = signals(tmp_path, CORES, 0, subtypes, *SHIPPED)
    assert set(made[0]) == {Path(scene).stem for scene in SHIPPED}
    assert differing(made) == []


def test_a_blas_is_told_which_kernels_to_choose():
    """Without this the tests above would compare one kernel with itself."""
    program = (
        "import numpy as np; r = np.random.default_rng(1).standard_normal((300, 300));"
        " print(hash((r @ r).tobytes()))"
    )
    found = set()
    for core in ("Haswell", "Nehalem"):
        line = [sys.executable, "-c", program]
        environment = os.environ | {"OPENBLAS_CORETYPE": core}
        found.add(
            subprocess.run(line, env=environment, capture_output=True, text=True, check=True).stdout
        )
    assert len(found) == 2
