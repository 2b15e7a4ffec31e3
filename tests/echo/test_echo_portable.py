"""Poses and exact echoes have the same bytes whatever the processor.

Other processors are emulated in processes of their own.

The quick test takes numpy's and the BLAS's vector instructions away. The slow one also compiles the
kernels for two other processors, which takes some minutes the first time.
"""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from builtin_records import RECORDS
from craft import NETWORK, craft, row
from lowalt.config.network import Network
from lowalt.echo.chunk import clean_signals
from lowalt.motion import poses
from lowalt.targets.make import make
from moving_clouds import recorded_cloud

NEW = "X86_V4 AVX512_ICL AVX512_SPR"
OLD = "X86_V3 AVX2 FMA3"
LIBRARIES = {"NPY_DISABLE_CPU_FEATURES": f"{NEW} {OLD}", "OPENBLAS_CORETYPE": "Nehalem"}
PROCESSORS = {
    "haswell": {
        "NPY_DISABLE_CPU_FEATURES": NEW,
        "OPENBLAS_CORETYPE": "Haswell",
        "NUMBA_CPU_NAME": "haswell",
        "NUMBA_CPU_FEATURES": "+sse4.2,+avx,+avx2,+fma,+bmi,+bmi2,+popcnt,+lzcnt",
    },
    "nehalem": LIBRARIES | {"NUMBA_CPU_NAME": "nehalem", "NUMBA_CPU_FEATURES": "+sse4.2,+popcnt"},
}


def digest(count: int) -> str:
    """SHA-256 of the poses and of the stored signals of `count` motion models of each target."""
    network = Network.from_settings(NETWORK | {"symbols": 400})
    total = hashlib.sha256()
    crow = make(RECORDS["Crow"], None, 1)
    played = {"start_s": 0.3, "playback": 0.9}
    for cloud, more in ((craft(), {}), (crow, {}), (recorded_cloud(), played)):
        for model in range(count):
            motion = row(model) | more | {"subtype": cloud.subtype, "rate_hz": 3.7 + model}
            for array in poses(cloud, motion, network.times_s):
                total.update(np.ascontiguousarray(array).tobytes())
            total.update(
                clean_signals(network, ["A", "B"], {cloud.subtype: cloud}, [motion], None).tobytes()
            )
    return total.hexdigest()


def digest_on(processor: dict[str, str], count: int, folder: Path) -> str:
    """The digest that a process of its own computes.

    Its libraries and compiler are told of another processor.
    """
    call = [sys.executable, "-c", f"from test_echo_portable import digest; print(digest({count}))"]
    paths = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    kept = {"NUMBA_CACHE_DIR": str(folder)} if "NUMBA_CPU_NAME" in processor else {}
    run = subprocess.run(
        call,
        env=os.environ | processor | kept | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


def test_bytes_do_not_depend_on_the_libraries_vector_instructions(tmp_path):
    assert digest_on(LIBRARIES, 2, tmp_path) == digest(2)


@pytest.mark.slow
@pytest.mark.parametrize("name", PROCESSORS)
def test_bytes_do_not_depend_on_the_processor(name, tmp_path):
    assert digest_on(PROCESSORS[name], 40, tmp_path) == digest(40)
