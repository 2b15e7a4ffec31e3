"""Other processors on this one: environments in which NumPy, BLAS, numba and the C library leave
out instructions.
"""

import os
import platform
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
_SSE = "+64bit,+cx16,+fxsr,+mmx,+popcnt,+sahf,+sse,+sse2,+sse3,+sse4.1,+sse4.2,+ssse3"
_AVX2 = _SSE + ",+avx,+avx2,+bmi,+bmi2,+f16c,+fma,+fsgsbase,+lzcnt,+movbe,+xsave"
# Both of NumPy's ways to name what it dispatches to: single features before version 2.4, levels
# since.
_AVX512 = "X86_V4 AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR"
EMULATED = {
    "avx2": {
        "NPY_DISABLE_CPU_FEATURES": _AVX512,
        "OPENBLAS_CORETYPE": "Haswell",
        "NUMBA_CPU_NAME": "haswell",
        "NUMBA_CPU_FEATURES": _AVX2,
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX512VL,-AVX512DQ",
    },
    "x86-64-v2": {
        "NPY_DISABLE_CPU_FEATURES": f"X86_V3 AVX F16C FMA3 AVX2 {_AVX512}",
        "OPENBLAS_CORETYPE": "Nehalem",
        "NUMBA_CPU_NAME": "nehalem",
        "NUMBA_CPU_FEATURES": _SSE,
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX512VL,-AVX512DQ,-AVX2,-FMA,-FMA4,-AVX",
    },
    "avx512": {
        "OPENBLAS_CORETYPE": "SkylakeX",
        "NUMBA_CPU_NAME": "skylake-avx512",
        "NUMBA_CPU_FEATURES": _AVX2 + ",+adx,+avx512f,+avx512cd,+avx512bw,+avx512dq,+avx512vl",
    },
}
"""Variables of each emulated processor: no AVX-512, nothing beyond x86-64-v2, an early AVX-512."""


def able(name: str) -> bool:
    """Whether this machine has all instructions of an emulated processor."""
    if platform.machine() not in ("x86_64", "AMD64") or not Path("/proc/cpuinfo").exists():
        return False
    flags = Path("/proc/cpuinfo").read_text().split()
    return {"avx2": "avx2" in flags, "x86-64-v2": True, "avx512": "avx512vl" in flags}[name]


def run(name: str, *arguments: str, threads: int = 1) -> str:
    """Run Python with these arguments as on the emulated processor and return what it prints."""
    more = {
        f"{library}_NUM_THREADS": str(threads) for library in ("OPENBLAS", "OMP", "NUMBA", "MKL")
    }
    environment = os.environ | EMULATED.get(name, {}) | more | {"PYTHONPATH": str(ROOT / "src")}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", *arguments],
        env=environment,
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


if __name__ == "__main__":
    processor, *words = sys.argv[1:]
    if able(processor):
        run(processor, *words)
