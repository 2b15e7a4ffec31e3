"""Signals of scenes made in processes that are told which processor they run on."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from emulation import EMULATED, able

ROOT = Path(__file__).parents[2]
CORES = ("SkylakeX", "Haswell", "Nehalem", "Zen")
"""Processors whose kernels OpenBLAS is told to choose. All run here: kernels that need more than
this processor has are refused by OpenBLAS itself, which then takes others."""
SMALLER = "Haswell"
"""The one of them that NumPy, numba and the C library are told to be as well: it has no AVX-512."""

PROBE = """
import sys
import numpy as np
from pathlib import Path
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
for overlays in scenes:
    name = Path(overlays).stem
    config = overlaid(overlays.split(","))
    config["targets"]["select"] = subtypes.split(",")
    if int(symbols):
        config["network"]["symbols"] = int(symbols)
    dataset = Dataset(config)
    for number in range(0, len(dataset), dataset.plan.models * len(dataset.plan.snrs)):
        dataset.maker.signal(dataset.row(dataset.place(number)), np.inf)
np.savez(path, **{name: np.stack(parts) for name, parts in found.items()})
"""


def started(folder: Path, core: str, *words: str) -> subprocess.Popen:
    """A process that makes signals as on a processor and writes FOLDER/CORE.npz."""
    more = {"OPENBLAS_CORETYPE": core, "PYTHONPATH": str(ROOT / "src"), "OMP_NUM_THREADS": "1"}
    if core == SMALLER and able("avx2"):
        more |= EMULATED["avx2"]
    line = [sys.executable, "-W", "ignore", "-c", PROBE, str(folder / f"{core}.npz"), *words]
    return subprocess.Popen(
        line, cwd=ROOT, env=os.environ | more, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL
    )


def signals(
    folder: Path, cores: tuple[str, ...], symbols: int, subtypes: str, *scenes: str
) -> list[dict[str, np.ndarray]]:
    """The signals of scenes by name, made with the kernels of each core.

    scenes: overlays on the default, joined by commas; the last one's stem is the name. symbols: of
    a look, 0 for all.
    """
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
