"""The benchmark's samples on other processors, and whichever kernels a BLAS chooses."""

from pathlib import Path

import numpy as np
import pytest

from blas_kernels import CORES, differing, signals
from emulation import EMULATED, able, run
from lowalt.extensions.benchmark import definition, frozen_bytes

ROOT = Path(__file__).parents[3]
NAMES = [
    pytest.param(name, marks=pytest.mark.skipif(not able(name), reason=f"no {name} here"))
    for name in EMULATED
]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_samples_of_the_benchmark_have_their_kept_checksums_on_another_processor(name, tmp_path):
    """One sample of each subtype, and some of every other part.

    `tests/benchmark` makes them again natively.
    """
    run(name, "-m", "lowalt.extensions.benchmark", "results", "--samples", "--out", str(tmp_path))
    made, kept = (
        (folder / frozen_bytes.SAMPLES).read_text().splitlines()
        for folder in (tmp_path, ROOT / frozen_bytes.REFERENCE)
    )
    assert len(made) == len(kept) == 64
    # The part clutter has effects, whose last bits follow the processor: `test_bytes_effects.py` says how
    # far apart they are.
    exact = [line for line in kept if "  clutter/" not in line]
    assert len(exact) == 56 and set(exact) <= set(made)


CLUTTER = """
import sys
import numpy as np
from lowalt.extensions.benchmark.definition import config_of
from lowalt.shards.dataset import Dataset
dataset = Dataset(config_of("clutter"))
images, signals, _ = zip(*(dataset.made(dataset.place(number)) for number in (0, len(dataset) // 2)))
np.savez(sys.argv[1], images=np.stack(images), signals=np.stack(signals))
"""


@pytest.mark.slow
@pytest.mark.parametrize("other", NAMES)
def test_samples_of_the_benchmark_s_clutter_differ_in_the_last_bit_of_few_values_and_in_no_pixel(
    other, tmp_path
):
    for name in ("native", other):
        run(name, "-c", CLUTTER, str(tmp_path / f"{name}.npz"))
    here, there = (np.load(tmp_path / f"{name}.npz") for name in ("native", other))
    apart = abs(here["signals"] - there["signals"])
    assert (apart <= 2 * np.finfo(np.float32).eps * abs(here["signals"])).all() and (
        apart > 0
    ).mean() < 0.01
    assert (here["images"] == there["images"]).all() and here["images"].std() > 0


@pytest.mark.slow
def test_signals_of_the_clutter_do_not_follow_the_kernels_of_a_blas(tmp_path):
    subtypes = "DJI Mini 2,Owl,NIO ET5T 2023,Walking Pedestrian 1"
    made = signals(tmp_path, CORES, 0, subtypes, ",".join(definition.overlays("clutter")))
    assert differing(made) == []
