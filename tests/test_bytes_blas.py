"""Scenes and the benchmark's town have the same signals whichever kernels a BLAS chooses.

The comparison is of double precision, before rounding to the kept precision hides all but a few differences.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
CORES = ("SkylakeX", "Haswell", "Nehalem", "Zen")
"""Processors whose kernels OpenBLAS is told to choose. All run here: kernels that need more than this processor has are
refused by OpenBLAS itself, which then takes others."""

PROBE = """
import sys
import numpy as np
from lowalt.extensions.benchmark.definition import config_of
from lowalt.config.layers import overlaid
from lowalt.scene.chain import SceneSample
from lowalt.shards.dataset import Dataset
found = {}
received = SceneSample.received
def noted(sample):
    result = received(sample)
    found.setdefault(name, []).append(np.append(result.signal.astype(complex), result.power))
    return result
SceneSample.received = noted
path, symbols, subtypes, *scenes = sys.argv[1:]
for name in scenes:
    config = config_of("town") if name == "town" else overlaid([f"config/scenes/{name}.yaml"])
    config["targets"]["select"] = subtypes.split(",")
    if int(symbols):
        config["network"]["symbols"] = int(symbols)
    dataset = Dataset(config)
    for number in range(0, len(dataset), dataset.plan.models * len(dataset.plan.snrs)):
        dataset.maker.signal(dataset.row(dataset.place(number)), np.inf)
np.savez(path, **{name: np.stack(parts) for name, parts in found.items()})
"""


def started(folder: Path, core: str, *words: str) -> subprocess.Popen:
    """A process that makes signals with the BLAS kernels of a processor and writes FOLDER/CORE.npz."""
    more = {"OPENBLAS_CORETYPE": core, "PYTHONPATH": str(ROOT / "src"), "OMP_NUM_THREADS": "1"}
    line = [sys.executable, "-W", "ignore", "-c", PROBE, str(folder / f"{core}.npz"), *words]
    return subprocess.Popen(line, cwd=ROOT, env=os.environ | more, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)


def signals(
    folder: Path, cores: tuple[str, ...], symbols: int, subtypes: str, *scenes: str
) -> list[dict[str, np.ndarray]]:
    """The signals of scenes by name, made with the kernels of each core; symbols: of a look, 0 for all."""
    made = [started(folder, core, str(symbols), subtypes, *scenes) for core in cores]
    for process in made:
        _, said = process.communicate()
        assert process.returncode == 0, said.decode()[-2000:]
    return [dict(np.load(folder / f"{core}.npz")) for core in cores]


def differing(made: list[dict[str, np.ndarray]]) -> list[tuple[str, str]]:
    """Pairs (core, scene) whose signals are not those of the first core in every bit."""
    first = made[0]
    assert all(abs(values).max() > 0 for values in first.values())
    return [
        (core, name)
        for core, values in zip(CORES, made, strict=False)
        for name in first
        if values[name].tobytes() != first[name].tobytes()
    ]


def test_signals_with_canceller_links_and_phase_noise_do_not_follow_the_kernels_of_a_blas(tmp_path):
    """Two scenes that call for most of the linear algebra; looks are short, and Zen, whose kernels are
    Haswell's, is left to the slow test, so that the processes take seconds."""
    assert differing(signals(tmp_path, CORES[:3], 64, "Owl", "triangle", "sensing")) == []


SHIPPED = sorted(path.stem for path in (ROOT / "config/scenes").glob("*.yaml") if path.stem != "paper")


@pytest.mark.slow
def test_signals_of_every_shipped_scene_and_of_the_town_do_not_follow_the_kernels_of_a_blas(tmp_path):
    made = signals(tmp_path, CORES, 0, "DJI Mini 2,Owl,NIO ET5T 2023,Walking Pedestrian 1", "town", *SHIPPED)
    assert set(made[0]) == {"town", *SHIPPED}
    assert differing(made) == []


def test_a_blas_is_told_which_kernels_to_choose():
    """Without this the tests above would compare one kernel with itself."""
    program = (
        "import numpy as np; r = np.random.default_rng(1).standard_normal((300, 300)); print(hash((r @ r).tobytes()))"
    )
    found = set()
    for core in ("Haswell", "Nehalem"):
        line, environment = [sys.executable, "-c", program], os.environ | {"OPENBLAS_CORETYPE": core}
        found.add(subprocess.run(line, env=environment, capture_output=True, text=True, check=True).stdout)
    assert len(found) == 2
