"""A description of the machine for measured figures: processor, cores, memory and GPU."""

import os
import platform
import shutil
import subprocess
from pathlib import Path


def processor() -> str:
    """Return the processor's name as the system gives it."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return " ".join(line.partition(":")[2].split())
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _accelerator() -> str:
    """Name of the first visible NVIDIA GPU from nvidia-smi, "no GPU" without one.

    No framework is imported for it.
    """
    tool = shutil.which("nvidia-smi")
    if not tool or os.environ.get("CUDA_VISIBLE_DEVICES") in ("", "-1"):
        return "no GPU"
    query = subprocess.run(
        [tool, "--query-gpu=name", "--format=csv,noheader"], capture_output=True, text=True
    )
    if query.returncode != 0:
        return "no GPU"
    first, _, _ = query.stdout.partition("\n")
    return first.strip() or "no GPU"


def describe() -> str:
    """Return one line, such as "Intel Xeon; 2 cores; 24 GiB; no GPU".

    It has no commas, since it stands in cells of CSV.
    """
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{processor()}; {cores} cores; {memory:.0f} GiB; {_accelerator()}".replace(",", " ")
